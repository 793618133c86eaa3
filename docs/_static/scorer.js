// The page of a name comes first where the query is that name.
var Scorer = {
  score: function (result) {
    var name = result[0].replace(/^.*[./]/, "").toLowerCase();
    var query = (new URLSearchParams(window.location.search).get("q") || "").trim().toLowerCase();
    var asked = query.replace(/^.*\./, "");
    return result[0].indexOf("reference/api/") === 0 && name === asked ? result[4] + 1000 : result[4];
  },
  objNameMatch: 11,
  objPartialMatch: 6,
  objPrio: { 0: 15, 1: 5, 2: -5 },
  objPrioDefault: 0,
  title: 15,
  partialTitle: 7,
  term: 5,
  partialTerm: 2
};
