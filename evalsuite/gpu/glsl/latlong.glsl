// Mitsuba's envmap look-up: math.sphere.direction_to_latlong and latlong_lookup.
uniform sampler2D env_latlong;
uniform mat3 env_to_local;

// The four weights are formed here: texture units of real GPUs round them to 8 bits.
vec3 env_radiance_at(float u, float v) {
    ivec2 size = textureSize(env_latlong, 0);
    float x = u * float(size.x) - 0.5, y = v * float(size.y - 1);
    int column = int(floor(x)), row = clamp(int(floor(y)), 0, size.y - 2);
    float across = x - float(column), down = y - float(row);
    int left = column < 0 ? column + size.x : (column >= size.x ? column - size.x : column);
    int right = left + 1 == size.x ? 0 : left + 1;
    vec3 upper = mix(texelFetch(env_latlong, ivec2(left, row), 0).rgb, texelFetch(env_latlong, ivec2(right, row), 0).rgb, across);
    vec3 lower = mix(texelFetch(env_latlong, ivec2(left, row + 1), 0).rgb, texelFetch(env_latlong, ivec2(right, row + 1), 0).rgb, across);
    return mix(upper, lower, down);
}

// u = 0 looks along local −z and grows towards +x; v = 0 is +y. atan of two arguments: acos loses digits at the poles.
vec2 direction_to_latlong(vec3 local) {
    float u = (local.x == 0.0 && local.z == 0.0) ? 0.0 : atan(local.x, -local.z) / (2.0 * 3.14159265358979323846);
    return vec2(u - floor(u), atan(length(local.xz), local.y) / 3.14159265358979323846);
}

// Radiance arriving from a world direction (any length but zero).
vec3 env_radiance(vec3 world_direction) {
    vec2 uv = direction_to_latlong(env_to_local * world_direction);
    return env_radiance_at(uv.x, uv.y);
}
