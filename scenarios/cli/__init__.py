"""The command line, `tlpsim`: a file of commands for each subject; `main` holds them together."""
