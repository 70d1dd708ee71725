// Triangle meshes to clip space, the same for every pass: `invariant` lets the shading pass meet the depth pre-pass exactly.
in vec3 in_position;
in vec3 in_normal;
in vec2 in_uv;

uniform mat4 world_to_clip;
#ifndef VERTEX_STAGE
uniform vec3 camera_position;  // else surface.glsl's
#endif

out vec3 v_position;
out vec3 v_normal;
out vec2 v_uv;
#ifdef VERTEX_STAGE
uniform bool two_sided;
out vec3 v_vertex_value;
#endif

invariant gl_Position;

void main() {
    gl_Position = world_to_clip * vec4(in_position, 1.0);
    v_position = in_position;
    v_normal = in_normal;
    v_uv = in_uv;
#ifdef VERTEX_STAGE
    bool from_behind = two_sided && dot(in_normal, camera_position - in_position) < 0.0;
    v_vertex_value = shade_vertex(from_behind ? -in_normal : in_normal);
#endif
}
