// math.probe.subsample_offsets: place of sample (i, j) of k × k within its texel.
vec2 subsample_offset(ivec2 cell, int k) {
    return (vec2(cell) + (vec2(cell.yx) + 0.5) / float(k)) / float(k);
}
