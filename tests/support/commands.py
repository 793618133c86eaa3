"""What commands print, and what they leave in a folder."""


def names(folder):
    return sorted(path.name for path in folder.iterdir())


def one_line(text):
    return " ".join(text.split())


def check_line(errors, match):
    """Check that a fault is one line of the program that says this."""
    assert errors.startswith("zerorate: ")
    assert errors.count("\n") == 1
    assert match in errors
