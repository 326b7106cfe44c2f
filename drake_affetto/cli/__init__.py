"""The `affetto` command: one small file a sub-command."""
