// math.phong.exponent_to_lod; textureLod clamps to the levels that exist.
float exponent_to_lod(float s, float face_width) {
    return log2(face_width * sqrt(3.0)) - 0.5 * log2(s + 1.0);
}
