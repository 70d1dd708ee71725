// The environment along each view ray. ray_origin + ray_step · window coordinates is the ray at unit depth, camera frame.
uniform vec2 ray_origin;
uniform vec2 ray_step;
uniform mat3 camera_to_world;
layout(location = 0) out vec4 out_radiance;
layout(location = 1) out vec4 out_variance;

void main() {
    vec3 local = vec3(ray_origin + ray_step * gl_FragCoord.xy, 1.0);
    out_radiance = vec4(env_radiance(camera_to_world * local), 0.0);
    out_variance = vec4(0.0);
}
