// Reflected direction and the LOD λ that hardware derives from it before any bias.
in vec3 v_position;
in vec3 v_normal;
in vec2 v_uv;
uniform vec3 camera_position;
uniform bool two_sided;
uniform float scored;
uniform float env_face_size;
layout(location = 0) out vec4 out_direction_lod;
layout(location = 1) out vec4 out_scored;

void main() {
    vec3 normal = normalize(v_normal), to_view = normalize(camera_position - v_position);
    float facing = dot(normal, to_view);
    if (two_sided && facing < 0.0) normal = -normal;
    vec3 r = reflect(-to_view, normal);
    float lod = face_lod(r, dFdx(r), dFdy(r), env_face_size);
    out_direction_lod = vec4(r, lod);
    out_scored = vec4((two_sided || gl_FrontFacing || facing > 0.0) ? scored : 0.0, 0.0, 0.0, 0.0);
}
