// OpenGL 4.5 core, table 8.19, as math.cubemap's AXIS, S and T.
const vec3 AXIS[6] = vec3[6](vec3(1, 0, 0), vec3(-1, 0, 0), vec3(0, 1, 0), vec3(0, -1, 0), vec3(0, 0, 1), vec3(0, 0, -1));
const vec3 S[6] = vec3[6](vec3(0, 0, -1), vec3(0, 0, 1), vec3(1, 0, 0), vec3(1, 0, 0), vec3(1, 0, 0), vec3(-1, 0, 0));
const vec3 T[6] = vec3[6](vec3(0, -1, 0), vec3(0, -1, 0), vec3(0, 0, 1), vec3(0, 0, -1), vec3(0, -1, 0), vec3(0, -1, 0));

// Direction, not of unit length, at a = 2s − 1, b = 2t − 1 of a face.
vec3 face_direction(int face, vec2 ab) {
    return AXIS[face] + ab.x * S[face] + ab.y * T[face];
}

// The texel (column, row, face) of faces width² that a direction meets: math.cubemap.direction_to_face.
ivec3 face_texel(vec3 d, int width) {
    vec3 m = abs(d);
    int axis = m.x >= m.y && m.x >= m.z ? 0 : (m.y >= m.z ? 1 : 2);
    int face = 2 * axis + int(d[axis] < 0.0);
    vec2 st = 0.5 * vec2(dot(d, S[face]), dot(d, T[face])) / m[axis] + 0.5;
    return ivec3(min(ivec2(st * float(width)), width - 1), face);
}
