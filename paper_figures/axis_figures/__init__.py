"""The figures of a refit: what its designs do on the user's axis, with names and units of its signals."""
