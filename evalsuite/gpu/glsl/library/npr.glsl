// Look-up in a sphere map that belongs to the viewer: math.npr.coordinates. LOCAL_VIEWER: v₀ is turned to each point's own view
// direction. FINEST: bilinear in level 0; else trilinear at the hardware's own λ.
uniform sampler2D npr_map;
uniform mat3 npr_frame;    // world → right, up, towards the viewer
uniform vec3 npr_up;       // the second row of npr_frame

vec3 npr_lookup(Surface s) {
#ifdef LOCAL_VIEWER
    vec3 right = normalize(cross(npr_up, s.to_view));
    vec2 p = vec2(dot(s.normal, right), dot(s.normal, cross(s.to_view, right)));
#else
    vec3 h = npr_frame * reflect(-s.to_view, s.normal) + vec3(0.0, 0.0, 1.0);
    vec2 p = h.xy / max(length(h), 1e-20);
#endif
#ifdef FINEST
    return textureLod(npr_map, 0.5 + 0.5 * p, 0.0).rgb;
#else
    return texture(npr_map, 0.5 + 0.5 * p).rgb;
#endif
}
