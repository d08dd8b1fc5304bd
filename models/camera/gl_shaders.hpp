/// The shaders of GlRenderer: the same steps as mesh_view.cpp, earth_view.cpp and optics.cpp. Not
/// installed.
#pragma once

#include <orrery/harness/kernel/simulator_only.hpp>

namespace orrery {

// Along the Sun's direction: distance towards the Sun and number of the nearest triangle.
inline constexpr const char* kShadowVertex = R"(#version 330 core
layout(location = 0) in vec4 place;
layout(location = 1) in vec3 position;
layout(location = 2) in vec3 normal;
layout(location = 3) in vec4 light;
layout(location = 4) in vec2 lobe_and_id;
uniform vec3 to_sun, sun_x, sun_y;
uniform float radius;
out float sunwards;
flat out float id;
void main() {
  sunwards = dot(position, to_sun);
  id = lobe_and_id.y;
  gl_Position = vec4(dot(position, sun_x) / radius, dot(position, sun_y) / radius,
                     -sunwards / radius * 0.999, 1);
  if (light.x <= 0) gl_Position = vec4(2, 2, 2, 1);  // turned away from the Sun
}
)";
inline constexpr const char* kShadowFragment = R"(#version 330 core
in float sunwards;
flat in float id;
out vec2 nearest;
void main() { nearest = vec2(sunwards, id); }
)";

inline constexpr const char* kMeshVertex = R"(#version 330 core
layout(location = 0) in vec4 place;
layout(location = 1) in vec3 position;
layout(location = 2) in vec3 normal;
layout(location = 3) in vec4 light;
layout(location = 4) in vec2 lobe_and_id;
uniform vec2 size;
out vec3 at;
flat out vec3 n;
flat out vec4 lit;
flat out vec2 lobe;
void main() {
  at = position;
  n = normal;
  lit = light;
  lobe = lobe_and_id;
  gl_Position = vec4((2 * place.xy / size - 1) * place.w, place.z * place.w, place.w);
}
)";
inline constexpr const char* kMeshFragment = R"(#version 330 core
in vec3 at;
flat in vec3 n;
flat in vec4 lit;  // cosine, by the Sun, by the Earth, factor of the lobe
flat in vec2 lobe;  // exponent, number of the triangle
uniform vec3 to_sun, sun_x, sun_y, camera;
uniform float radius;
uniform int shadow_size;
uniform sampler2D shadows;
out float radiance;
bool is_lit() {
  float scale = float(shadow_size) / (2 * radius);
  ivec2 texel = ivec2((vec2(dot(at, sun_x), dot(at, sun_y)) + radius) * scale);
  vec2 nearest = texelFetch(shadows, clamp(texel, 0, shadow_size - 1), 0).xy;
  if (nearest.y < 0 || nearest.y == lobe.y) return true;
  float slack = 1.5 / scale * (1 + 1 / max(lit.x, 0.05));
  return nearest.x - dot(at, to_sun) < slack;
}
void main() {
  radiance = lit.z;
  if (lit.x <= 0 || !is_lit()) return;
  radiance += lit.y;
  if (lit.w == 0) return;
  float cosine = max(0, dot(n, normalize(to_sun + normalize(camera - at))));
  radiance += lit.w * pow(cosine, lobe.x);
}
)";

inline constexpr const char* kWholeVertex = R"(#version 330 core
void main() {
  vec2 corner = vec2(gl_VertexID == 1 ? 3 : -1, gl_VertexID == 2 ? 3 : -1);
  gl_Position = vec4(corner, 0, 1);
}
)";
// The tangent's height from the distance at which the ray passes the centre: in floats the squares
// of earth_view.cpp would lose it from high orbits.
inline constexpr const char* kEarthFragment = R"(#version 330 core
uniform sampler2D rays, surface;
uniform mat3 R_EC;
uniform vec3 beta_C, to_sun, p;
uniform float stretch, sun, scale_height, limb_reflectance;
uniform int has_glint, cells;
out vec2 suns_and_covered;
const float pi = 3.14159265358979;
vec2 map_at(vec3 n) {
  if (cells == 1) return texelFetch(surface, ivec2(0, 0), 0).xy;
  vec3 size = abs(n);
  int axis = size.x >= size.y && size.x >= size.z ? 0 : size.y >= size.z ? 1 : 2;
  vec3 turned = axis == 0 ? n : axis == 1 ? n.yzx : n.zxy;
  vec2 at = turned.yz * (0.5 * float(cells) / abs(turned.x)) + 0.5 * float(cells - 1);
  at = clamp(at, 0, float(cells) - 1.001);
  ivec2 cell = ivec2(at);
  vec2 part = at - vec2(cell);
  cell.y += cells * (2 * axis + (turned.x < 0 ? 1 : 0));
  vec2 above = mix(texelFetch(surface, cell, 0).xy, texelFetch(surface, cell + ivec2(1, 0), 0).xy, part.x);
  vec2 below = mix(texelFetch(surface, cell + ivec2(0, 1), 0).xy, texelFetch(surface, cell + ivec2(1, 1), 0).xy, part.x);
  return mix(above, below, part.y);
}
float surface_radiance(vec3 d, vec3 q, float along, float h) {
  vec3 s = p + (along - sqrt(max(0, 1 - h * h)) / length(q)) * q;
  vec3 n = normalize(vec3(s.xy, s.z * stretch));
  vec2 map = map_at(n);
  float cosine = dot(n, to_sun);
  if (cosine <= 0) return sun / pi * map.y;
  float radiance = sun / pi * map.x * cosine;
  float water = clamp((0.10 - map.x) / (0.10 - 0.06), 0, 1);
  if (has_glint != 0 && water > 0) {
    float c = max(0, dot(n, normalize(to_sun - d)));
    radiance += water * sun * cosine * 0.02 * 38 / (8 * pi) * pow(c, 30);
  }
  return radiance;
}
void main() {
  vec4 ray = texelFetch(rays, ivec2(gl_FragCoord.xy), 0);
  vec3 d = R_EC * (ray.xyz - beta_C + dot(ray.xyz, beta_C) * ray.xyz);
  vec3 q = vec3(d.xy, d.z * stretch);
  float along = -dot(q, p) / dot(q, q);  // to the tangent point
  suns_and_covered = vec2(0);
  if (along <= 0) return;
  float h = length(cross(p, q)) / length(q);
  float height = 0.5 * (h - 1) * (h + 1);
  float covered = clamp(0.5 - height / (along * sqrt(ray.w)), 0, 1);
  float radiance = 0;
  if (covered > 0) radiance = covered * surface_radiance(d, q, along, h);
  float above = max(0, height);
  if (covered < 1 && limb_reflectance > 0 && above <= 10 * scale_height) {
    vec3 s = p + along * q;
    float cosine = dot(normalize(vec3(s.xy, s.z * stretch)), to_sun);
    radiance += (1 - covered) * sun / pi * limb_reflectance * max(0, cosine) * exp(-above / scale_height);
  }
  suns_and_covered = vec2(radiance * ray.w, covered);
}
)";

inline constexpr const char* kPointVertex = R"(#version 330 core
layout(location = 0) in vec2 corner;
layout(location = 1) in vec3 point;
uniform vec2 size;
flat out vec3 source;
void main() {
  source = point;
  gl_Position = vec4(2 * (corner + 0.5) / size - 1, 0, 1);
}
)";
// erfc by Numerical Recipes' Chebyshev fit (1.2e-7 of its value), so that the wings stay right.
inline constexpr const char* kPointFragment = R"(#version 330 core
flat in vec3 source;
uniform float sigma;
out float electrons;
float erfc(float x) {
  float z = abs(x), t = 1 / (1 + 0.5 * z);
  float sum = t * (-0.82215223 + t * 0.17087277);
  sum = t * (-1.13520398 + t * (1.48851587 + sum));
  sum = t * (-0.18628806 + t * (0.27886807 + sum));
  sum = t * (1.00002368 + t * (0.37409196 + t * (0.09678418 + sum)));
  float tail = t * exp(-z * z - 1.26551223 + sum);
  return x >= 0 ? tail : 2 - tail;
}
// Between the edges of pixel i, from the side on which the differences are not of ones.
float part(float i, float at) {
  float a = (i - 0.5 - at) / (sigma * sqrt(2.0)), b = (i + 0.5 - at) / (sigma * sqrt(2.0));
  return a + b > 0 ? 0.5 * (erfc(a) - erfc(b)) : 0.5 * (erfc(-b) - erfc(-a));
}
void main() {
  vec2 pixel = floor(gl_FragCoord.xy);
  electrons = source.z * part(pixel.x, source.x) * part(pixel.y, source.y);
}
)";

}  // namespace orrery
