// The material at a point of the surface: constants, or bitmaps looked up as Mitsuba's `bitmap` does (scene.model.Texture).
// The LOD of a bitmap is the hardware's for one sub-sample of a pixel: sub-samples are averaged afterwards.
uniform float map_bias;  // −log₂ of the sub-samples a pixel has along an axis
uniform vec3 diffuse_reflectance_value;
uniform vec3 specular_reflectance_value;
#ifdef DIFFUSE_REFLECTANCE_MAP
uniform sampler2D diffuse_reflectance_map;
uniform mat3 diffuse_reflectance_to_uv;
uniform int diffuse_reflectance_wrap;
#endif
#ifdef SPECULAR_REFLECTANCE_MAP
uniform sampler2D specular_reflectance_map;
uniform mat3 specular_reflectance_to_uv;
uniform int specular_reflectance_wrap;
#endif
#ifdef NORMAL_MAP
uniform sampler2D normal_map;
uniform mat3 normal_to_uv;
uniform int normal_wrap;
#endif

// wrap: 0 repeat (the sampler does it), 1 mirror, 2 clamp.
vec3 look_up(sampler2D map, mat3 to_uv, int wrap, vec2 uv) {
    vec2 st = (to_uv * vec3(uv, 1.0)).xy;
    vec2 dx = dFdx(st) * exp2(map_bias), dy = dFdy(st) * exp2(map_bias);
    if (wrap == 1) st = 1.0 - abs(mod(st, 2.0) - 1.0);
    return textureGrad(map, st, dx, dy).rgb;
}

void set_reflectances(vec2 uv) {
    diffuse_reflectance = diffuse_reflectance_value;
    specular_reflectance = specular_reflectance_value;
#ifdef DIFFUSE_REFLECTANCE_MAP
    diffuse_reflectance = look_up(diffuse_reflectance_map, diffuse_reflectance_to_uv, diffuse_reflectance_wrap, uv);
#endif
#ifdef SPECULAR_REFLECTANCE_MAP
    specular_reflectance = look_up(specular_reflectance_map, specular_reflectance_to_uv, specular_reflectance_wrap, uv);
#endif
}

// Normal of the material. normal: smooth, not yet turned towards the viewer; from_behind: seen from the back, where
// Mitsuba's `twosided` mirrors the frame's z alone.
vec3 material_normal(vec3 normal, vec3 position, vec2 uv, bool from_behind) {
    vec3 towards = from_behind ? -normal : normal;
#ifdef NORMAL_MAP
    vec3 m = 2.0 * look_up(normal_map, normal_to_uv, normal_wrap, uv) - 1.0;
    // ∂p/∂u up to a positive factor: on a triangle both are linear in window space, up to the same perspective.
    vec3 px = dFdx(position), py = dFdy(position);
    vec2 ux = dFdx(uv), uy = dFdy(uv);
    float area = ux.x * uy.y - uy.x * ux.y;
    vec3 dp_du = (px * uy.y - py * ux.y) * (area < 0.0 ? -1.0 : 1.0);
    vec3 tangent = dp_du - normal * dot(normal, dp_du);
    if (dot(tangent, tangent) > 0.0) {
        tangent = normalize(tangent);
        return normalize(m.x * tangent + m.y * cross(normal, tangent) + m.z * towards);
    }
#endif
    return towards;
}
