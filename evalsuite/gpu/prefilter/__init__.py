"""Environment maps filtered on the GPU before anything is drawn."""
