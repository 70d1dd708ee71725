// Calls the technique's shade() once a pixel. Alpha is `mark.frag`'s.
in vec3 v_position;
in vec3 v_normal;
in vec2 v_uv;
#ifdef VERTEX_STAGE
in vec3 v_vertex_value;
#endif
uniform bool two_sided;
layout(location = 0) out vec4 out_radiance;
layout(location = 1) out vec4 out_variance;

void main() {
    Surface s;
    s.position = v_position;
    s.to_view = normalize(camera_position - v_position);
    s.uv = v_uv;
    vec3 smooth_normal = normalize(v_normal);
    float facing = dot(smooth_normal, s.to_view);
    s.normal = material_normal(smooth_normal, v_position, v_uv, two_sided && facing < 0.0);
    set_reflectances(v_uv);
#ifdef VERTEX_STAGE
    s.vertex_value = v_vertex_value;
#else
    s.vertex_value = vec3(0.0);
#endif
    // Called for unseen sides too: implicit derivatives need all four pixels of a quad.
    vec3 radiance = shade(s);
    // One-sided materials are black from behind. At a silhouette a smooth normal can point away from the viewer on a
    // triangle that faces him: Mitsuba is black there, an engine shades on, and so do we.
    bool seen = two_sided || gl_FrontFacing || facing > 0.0;
    out_radiance = vec4(seen ? radiance : vec3(0.0), 1.0);
#ifdef WITH_VARIANCE
    out_variance = vec4(seen ? shade_variance : vec3(0.0), 0.0);
#else
    out_variance = vec4(0.0);
#endif
}
