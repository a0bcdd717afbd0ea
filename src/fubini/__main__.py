"""``python -m fubini``: the command line, where its script is not on the path."""

from fubini.cli import main

if __name__ == "__main__":
    main()
