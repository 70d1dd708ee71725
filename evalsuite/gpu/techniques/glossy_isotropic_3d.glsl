// LOBES blocks of SLICES octahedral maps each, at n·r = (k/(SLICES − 1))²: math.isotropic_map.
uniform sampler3D round_lobes;
uniform float map_size;
uniform vec3 lobe_energy[LOBES * SLICES];  // with the mean Fresnel factor of the slice
uniform float lobe_shift[LOBES * SLICES];  // angle of a lobe's axis from r towards n

vec3 shade(Surface s) {
    vec3 r = reflect(-s.to_view, s.normal);
    float n_r = clamp(dot(s.normal, s.to_view), 0.0, 1.0);
    float position = sqrt(n_r) * float(SLICES - 1);
    int k = min(int(position), SLICES - 2);
    float part = position - float(k);
    vec3 towards_n = s.normal - n_r * r;
    towards_n /= max(length(towards_n), 1e-6);  // at n = r there is no plane of incidence, and no shift
    vec3 sum = vec3(0.0);
    for (int i = k; i < LOBES * SLICES; i += SLICES) {
        float shift = mix(lobe_shift[i], lobe_shift[i + 1], part);
        vec3 axis = cos(shift) * r + sin(shift) * towards_n;
        float layer = (float(i) + part + 0.5) / float(LOBES * SLICES);
        vec3 radiance = textureLod(round_lobes, vec3(octahedral_coordinates(axis, map_size), layer), 0.0).rgb;
        sum += mix(lobe_energy[i], lobe_energy[i + 1], part) * radiance;
    }
    return specular_reflectance * sum;
}
