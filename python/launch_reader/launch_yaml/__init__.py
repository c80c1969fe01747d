"""Front ends of launch; doppel reads the files."""

