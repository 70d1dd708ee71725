"""Area lights out of environment maps, and point samples of them: pure NumPy, beside `math`."""
