"""Pictures in memory and on disk: (H, W, 3) float32, row 0 at the top, linear Rec.709."""
