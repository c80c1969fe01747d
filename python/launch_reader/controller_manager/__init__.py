"""The names of controller_manager."""
