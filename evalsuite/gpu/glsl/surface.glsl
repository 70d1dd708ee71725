// What every technique's `vec3 shade(Surface s)` may use.
struct Surface {
    vec3 position;      // world
    vec3 normal;        // world, unit, towards the viewer on two-sided materials
    vec3 to_view;       // world, unit
    vec2 uv;
    vec3 vertex_value;  // shade_vertex's, interpolated; 0 where a technique has none
};

const float PI = 3.14159265358979323846;

uniform vec3 camera_position;  // world
uniform vec3 camera_axis;      // world, unit: where the camera looks

// The environment as a cubemap: level 0 is env_face_size texels wide, env_max_level is 1×1.
uniform samplerCube env_cube;
uniform float env_face_size;
uniform float env_max_level;

// The material, as the technique's mapping states it. The two reflectances are set before shade() is called, from a bitmap
// where the material has one; shade_vertex() runs before that and must leave them to shade().
vec3 diffuse_reflectance;
vec3 specular_reflectance;
uniform float exponent;
uniform vec3 eta;
uniform vec3 k;
