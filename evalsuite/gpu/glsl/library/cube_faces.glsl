// OpenGL 4.5 core, table 8.19, as math.cubemap's AXIS, S and T.
const vec3 AXIS[6] = vec3[6](vec3(1, 0, 0), vec3(-1, 0, 0), vec3(0, 1, 0), vec3(0, -1, 0), vec3(0, 0, 1), vec3(0, 0, -1));
const vec3 S[6] = vec3[6](vec3(0, 0, -1), vec3(0, 0, 1), vec3(1, 0, 0), vec3(1, 0, 0), vec3(1, 0, 0), vec3(-1, 0, 0));
const vec3 T[6] = vec3[6](vec3(0, -1, 0), vec3(0, -1, 0), vec3(0, 0, 1), vec3(0, 0, -1), vec3(0, -1, 0), vec3(0, -1, 0));

// Direction, not of unit length, at a = 2s − 1, b = 2t − 1 of a face.
vec3 face_direction(int face, vec2 ab) {
    return AXIS[face] + ab.x * S[face] + ab.y * T[face];
}
