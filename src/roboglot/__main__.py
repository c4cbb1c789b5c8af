"""``python -m roboglot``."""

from roboglot.cli import main

if __name__ == "__main__":
    main()
