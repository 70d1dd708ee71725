// Geometry per pixel: shading normal and depth along the viewing axis; position and 1 + material index.
in vec3 v_position;
in vec3 v_normal;
in vec2 v_uv;
uniform vec3 camera_position;
uniform vec3 camera_axis;
uniform bool two_sided;
uniform float material;
layout(location = 0) out vec4 out_normal_depth;
layout(location = 1) out vec4 out_position_material;

void main() {
    vec3 normal = normalize(v_normal);
    if (two_sided && dot(normal, camera_position - v_position) < 0.0) normal = -normal;
    out_normal_depth = vec4(normal, dot(camera_axis, v_position - camera_position));
    out_position_material = vec4(v_position, 1.0 + material);
}
