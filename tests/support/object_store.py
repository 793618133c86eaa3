"""An object store on this machine: the part of S3's protocol that reads and lists."""

import threading
from contextlib import contextmanager
from email.utils import formatdate
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from urllib.parse import parse_qs, unquote, urlsplit
from xml.sax.saxutils import escape


@contextmanager
def object_store(folder):
    """Serve the folders in a folder as buckets; yield what gives their addresses."""

    class Handler(BaseHTTPRequestHandler):
        protocol_version = "HTTP/1.1"

        def do_HEAD(self):
            self._answer_object()

        def do_GET(self):
            split = urlsplit(self.path)
            query = parse_qs(split.query, keep_blank_values=True)
            if "list-type" in query:
                self._answer_list(unquote(split.path).strip("/"), query.get("prefix", [""])[0])
            else:
                self._answer_object()

        def _answer_object(self):
            path = folder / unquote(urlsplit(self.path).path).strip("/")
            if not path.is_file():
                return self._send(404, b"", {})
            content, state = path.read_bytes(), path.stat()
            headers = {"Last-Modified": formatdate(state.st_mtime, usegmt=True), "ETag": '"0"'}
            span = self.headers.get("Range")
            if span is None:
                return self._send(200, content, headers)
            first, last = (int(part) for part in span.removeprefix("bytes=").split("-"))
            part = content[first : last + 1]
            headers["Content-Range"] = f"bytes {first}-{first + len(part) - 1}/{len(content)}"
            return self._send(206, part, headers)

        def _answer_list(self, bucket, prefix):
            top = folder / bucket
            files = sorted(path for path in top.rglob("*") if path.is_file())
            keys = [(path.relative_to(top).as_posix(), path) for path in files]
            contents = "".join(
                f"<Contents><Key>{escape(key)}</Key><Size>{path.stat().st_size}</Size>"
                f"<LastModified>2026-01-01T00:00:00.000Z</LastModified></Contents>"
                for key, path in keys
                if key.startswith(prefix)
            )
            text = f"<ListBucketResult><IsTruncated>false</IsTruncated>{contents}"
            self._send(200, f"{text}</ListBucketResult>".encode(), {})

        def _send(self, status, content, headers):
            self.send_response(status)
            for name, value in {**headers, "Content-Length": str(len(content))}.items():
                self.send_header(name, value)
            self.end_headers()
            if self.command == "GET":
                self.wfile.write(content)

        def log_message(self, *_):
            pass

    with ThreadingHTTPServer(("127.0.0.1", 0), Handler) as server:
        server.daemon_threads = True
        threading.Thread(target=server.serve_forever, daemon=True).start()
        query = f"?scheme=http&endpoint_override=127.0.0.1:{server.server_address[1]}"
        yield lambda path: f"s3://key:secret@{path}{query}"
        server.shutdown()
