// Reflected direction and the LOD λ that hardware derives from it before any bias: math.cubemap.reflection_lod.
// Formed here from dFdx/dFdy because textureQueryLod of cubes is wrong by whole levels on some drivers.
in vec3 v_position;
in vec3 v_normal;
in vec2 v_uv;
uniform vec3 camera_position;
uniform bool two_sided;
uniform float scored;
uniform float env_face_size;
layout(location = 0) out vec4 out_direction_lod;
layout(location = 1) out vec4 out_scored;

float face_lod(vec3 r, vec3 dx, vec3 dy) {
    vec3 m = abs(r);
    // Major axis last; the sign and order of the other two do not change a length.
    if (m.x >= m.y && m.x >= m.z) { r = r.yzx; dx = dx.yzx; dy = dy.yzx; }
    else if (m.y >= m.z) { r = r.zxy; dx = dx.zxy; dy = dy.zxy; }
    vec2 along_x = 0.5 * env_face_size * (dx.xy * r.z - r.xy * dx.z) / (r.z * r.z);
    vec2 along_y = 0.5 * env_face_size * (dy.xy * r.z - r.xy * dy.z) / (r.z * r.z);
    return log2(max(max(length(along_x), length(along_y)), 1e-30));
}

void main() {
    vec3 normal = normalize(v_normal), to_view = normalize(camera_position - v_position);
    float facing = dot(normal, to_view);
    if (two_sided && facing < 0.0) normal = -normal;
    vec3 r = reflect(-to_view, normal);
    float lod = face_lod(r, dFdx(r), dFdy(r));
    out_direction_lod = vec4(r, lod);
    out_scored = vec4((two_sided || gl_FrontFacing || facing > 0.0) ? scored : 0.0, 0.0, 0.0, 0.0);
}
