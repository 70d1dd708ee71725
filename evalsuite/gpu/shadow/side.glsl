// What the hard pass and the wedge pass must decide alike, to the bit.
uniform vec3 to_light;  // D: world, unit, to the light's centre
uniform vec3 tangent;   // T and B with T × B = D
uniform vec3 bitangent;

// Which side of the plane through an edge and the light's centre p is on: 1 where the light's centre, seen from p, lies left of
// the edge, else 0.
float left_side(vec3 p, vec3 from, vec3 to) {
    vec3 a = from - p, b = to - p;
    precise float ax = dot(a, tangent), ay = dot(a, bitangent), bx = dot(b, tangent), by = dot(b, bitangent);
    precise float side = ax * by - ay * bx;
    return side >= 0.0 ? 1.0 : 0.0;
}

// How often an edge counts: once in the outline of what faces the light, once in that of what faces away. Both are the same
// where a mesh is closed; at an open edge they differ, and the larger of the two shadows is taken in the end. +1: the shadow is
// on the edge's left, −1: on its right. left, right: whether the triangles there face the light.
vec2 outline(bool left, bool right, bool closed) {
    float l = left ? 1.0 : 0.0, r = right ? 1.0 : 0.0;
    return closed ? vec2(l - r) : vec2(l, l - 1.0);
}
