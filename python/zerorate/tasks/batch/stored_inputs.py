"""Logs of a batch in an object store, by address."""

from collections.abc import Collection, Sequence
from pathlib import PurePosixPath
from posixpath import commonpath, relpath

from zerorate.faults import ArgumentError
from zerorate.io.formats import known_suffixes
from zerorate.io.remote import hide_secrets, is_address
from zerorate.io.store import Listing, StoredFile, list_store
from zerorate.tasks.batch.inputs import SUMMARY, Inputs, LogFile, is_result_name


def find_stored_inputs(addresses: Sequence[str]) -> Inputs:
    """Return the logs of addresses in a store; OSError if an address has no log."""
    local = next((one for one in addresses if not is_address(one)), None)
    if local is not None:
        raise ArgumentError("sources", f"must all be addresses or all be files, got '{local}' too")
    listings = {address: list_store(address) for address in addresses}
    root = commonpath([listing.folder for listing in listings.values()])
    logs: dict[str, LogFile] = {}
    suffixes = known_suffixes()
    for address, listing in listings.items():
        found = [one for one in listing.files if _is_log(one, listing, address, suffixes)]
        if not found:
            raise FileNotFoundError(f"no log is at '{hide_secrets(address)}'")
        for one in found:
            name = relpath(one.path, root)
            logs[name] = LogFile(name, one.address, (one.size, one.modified))
    return Inputs(tuple(logs[name] for name in sorted(logs)), {}, ())


def _is_log(file: StoredFile, listing: Listing, address: str, suffixes: Collection[str]) -> bool:
    """Return True if a file is a log: by suffix within a folder, and not written by zerorate."""
    path = PurePosixPath(file.path)
    if listing.is_folder and (path.name[0] == "." or path.suffix.lower() not in suffixes):
        return False
    named = PurePosixPath(address.partition("?")[0])
    return (path.name != SUMMARY or named.name == SUMMARY) and not is_result_name(path, named)
