// math.probe.subsample_offsets: place of sample s of k × k within its texel.
vec2 subsample_offset(int s, int k) {
    int n = k * k;
    uint mirrored = bitfieldReverse(uint(s)) >> (32 - findMSB(n));
    return (vec2(s, mirrored) + 0.5) / float(n);
}
