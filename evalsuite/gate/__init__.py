"""The regression gate: results against a blessed baseline. Reads results and pictures; draws and renders nothing."""
