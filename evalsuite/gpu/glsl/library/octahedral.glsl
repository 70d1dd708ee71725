// math.octahedral: (a, b) in [−1, 1]² ↔ direction; maps are stored with a border of one texel.
vec2 octahedral_from_direction(vec3 d) {
    vec3 p = d / (abs(d.x) + abs(d.y) + abs(d.z));
    vec2 side = vec2(p.x < 0.0 ? -1.0 : 1.0, p.y < 0.0 ? -1.0 : 1.0);
    return p.z < 0.0 ? (1.0 - abs(p.yx)) * side : p.xy;
}

vec3 octahedral_to_direction(vec2 ab) {
    if (abs(ab.x) > 1.0) ab = vec2(2.0 * sign(ab.x) - ab.x, -ab.y);
    if (abs(ab.y) > 1.0) ab = vec2(-ab.x, 2.0 * sign(ab.y) - ab.y);
    vec2 side = vec2(ab.x < 0.0 ? -1.0 : 1.0, ab.y < 0.0 ? -1.0 : 1.0);
    float z = 1.0 - abs(ab.x) - abs(ab.y);
    return normalize(vec3(ab - side * max(-z, 0.0), z));
}

// Texture coordinates in a map of `width` texels without its border.
vec2 octahedral_coordinates(vec3 d, float width) {
    return (0.5 * (octahedral_from_direction(d) + 1.0) * width + 1.0) / (width + 2.0);
}
