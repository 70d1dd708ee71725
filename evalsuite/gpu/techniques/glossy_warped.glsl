uniform sampler2DArray view_maps;      // L_o(v_i, n) over the xy of n in view i's frame: math.view_maps
uniform mat3 view_frames[VIEWS];       // right, up, v_i
uniform vec3 triangles[TRIANGLES];     // numbers of three views each
uniform mat3 to_shares[TRIANGLES];     // [v_a v_b v_c]⁻¹
uniform float map_size;

vec3 radiance_of(int i, vec3 r) {
    vec3 mirroring = normalize(r + view_frames[i][2]) * view_frames[i];
    vec2 at = (mirroring.xy * (0.5 * map_size - 1.0) + 0.5 * map_size) / map_size;
    return textureLod(view_maps, vec3(at, float(i)), 0.0).rgb;
}

vec3 shade(Surface s) {
    vec3 v = s.to_view, r = reflect(-v, s.normal);
    int face = 0;  // the triangle of fixed views that v is in
    vec3 share = vec3(-1e9);
    for (int i = 0; i < TRIANGLES; ++i) {
        vec3 lambda = to_shares[i] * v;
        if (min(lambda.x, min(lambda.y, lambda.z)) > min(share.x, min(share.y, share.z))) { share = lambda; face = i; }
    }
    ivec3 views = ivec3(triangles[face] + 0.5);
    mat3 corners = mat3(view_frames[views.x][2], view_frames[views.y][2], view_frames[views.z][2]);
    share = max(share, 0.0);
    share *= vec3(greaterThan(1.0 + r * corners, vec3(SINGULAR)));  // r = −v_i is the whole rim of a map
    share /= max(share.x + share.y + share.z, 1e-9);
    vec3 sum = vec3(0.0);
    for (int j = 0; j < 3; ++j) if (share[j] > 0.0) sum += share[j] * radiance_of(views[j], r);
    return specular_reflectance * sum;
}
