"""``python -m zerorate``."""

from zerorate.cli import main

if __name__ == "__main__":
    main()
