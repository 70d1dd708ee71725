// LOD λ of a cubemap look-up about r with screen derivatives dx, dy: math.cubemap.reflection_lod. Formed by hand because
// textureQueryLod of cubes is wrong by whole levels on some drivers, and hardware's own λ only approximate.
float face_lod(vec3 r, vec3 dx, vec3 dy, float face_size) {
    vec3 m = abs(r);
    // Major axis last; the sign and order of the other two do not change a length.
    if (m.x >= m.y && m.x >= m.z) { r = r.yzx; dx = dx.yzx; dy = dy.yzx; }
    else if (m.y >= m.z) { r = r.zxy; dx = dx.zxy; dy = dy.zxy; }
    vec2 along_x = 0.5 * face_size * (dx.xy * r.z - r.xy * dx.z) / (r.z * r.z);
    vec2 along_y = 0.5 * face_size * (dy.xy * r.z - r.xy * dy.z) / (r.z * r.z);
    return log2(max(max(length(along_x), length(along_y)), 1e-30));
}
