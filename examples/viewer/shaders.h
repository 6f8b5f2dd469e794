/* shaders.h - the viewer's GLSL, which is 3.30 and 3.00 ES, one line a string. */
#ifndef EXAMPLES_VIEWER_SHADERS_H
#define EXAMPLES_VIEWER_SHADERS_H

#ifdef __EMSCRIPTEN__
  #define VIEWER_GLSL "#version 300 es\nprecision highp float;\nprecision highp int;\n"
#else
  #define VIEWER_GLSL "#version 330 core\n"
#endif

/* A surface: place, normal, and the original place. `corner` serves the edges of single triangles. */
static const char *const viewer_surface_vertex[] = {
    VIEWER_GLSL,
    "layout(location = 0) in vec3 position;\n",
    "layout(location = 1) in vec3 normal;\n",
    "layout(location = 2) in vec3 original;\n",
    "layout(location = 3) in vec3 color;\n",
    "uniform mat4 to_clip;\n",
    "uniform vec3 offset;\n",
    "out vec3 place, facing, origin, paint, corner;\n",
    "void main() {\n",
    "  place = position + offset;\n",
    "  facing = normal;\n",
    "  origin = original;\n",
    "  paint = color;\n",
    "  corner = vec3(gl_VertexID % 3 == 0, gl_VertexID % 3 == 1, gl_VertexID % 3 == 2);\n",
    "  gl_Position = to_clip * vec4(place, 1);\n",
    "}\n",
};

/* Two lights that follow the camera, and the brush's ball as a colored spot. The texture is that of
 * raycast_correspondence_color: hue by longitude around the box of the original, times a checker. */
static const char *const viewer_surface_fragment[] = {
    VIEWER_GLSL,
    "in vec3 place, facing, origin, paint, corner;\n",
    "uniform vec3 eye, right, up, forward, base;\n",
    "uniform vec3 middle;\n",        /* of the original's box */
    "uniform int painting;\n",       /* 0 base, 1 the checker, 2 the vertices' colours */
    "uniform bool tinted;\n",        /* these colours multiply the base or the checker */
    "uniform bool edges, plain;\n",  /* edges of each triangle are dark; plain: no light */
    "uniform vec4 brush;\n",         /* centre and radius; radius 0: none */
    "out vec4 result;\n",
    "vec3 hsv(float h, float s, float v) {\n",
    "  vec3 k = abs(fract(h + vec3(0, 2, 1) / 3.0) * 6.0 - 3.0);\n",
    "  return v * mix(vec3(1), clamp(k - 1.0, 0.0, 1.0), s);\n",
    "}\n",
    "vec3 checker(vec3 d) {\n",
    "  d = normalize(d);\n",
    "  float turn = atan(d.y, d.x) / 6.2831853, height = acos(clamp(d.z, -1.0, 1.0)) / 3.1415927;\n",
    "  int square = int(floor(turn * 16.0 + 64.0)) + int(floor(height * 8.0));\n",
    "  return hsv(turn + 0.08, 0.55 + 0.2 * height, (square & 1) == 1 ? 0.95 : 0.62);\n",
    "}\n",
    "void main() {\n",
    "  vec3 to_eye = normalize(eye - place), n = normalize(facing);\n",
    "  bool inside = !gl_FrontFacing;\n", /* at the outline of coarse triangles n may face away though the triangle does not */
    "  if (inside) n = -n;\n",
    "  vec3 color = painting == 1 ? checker(origin - middle) : painting == 2 ? paint : base;\n",
    "  if (tinted && painting != 2) color *= paint;\n",
    "  float key = max(0.0, dot(n, normalize(up * 0.7 - right * 0.5 - forward * 0.8)));\n",
    "  float fill = max(0.0, dot(n, normalize(right - forward * 0.6 - up * 0.3)));\n",
    "  float gloss = pow(max(0.0, dot(n, normalize(normalize(up * 0.7 - right * 0.5 - forward * 0.8) + to_eye))), 40.0);\n",
    "  vec3 lit = color * (0.26 + 0.68 * key + 0.16 * fill) + 0.12 * gloss;\n",
    "  if (inside) lit *= 0.55;\n",
    "  if (plain) lit = base;\n",
    "  if (edges) {\n",
    "    vec3 near = smoothstep(vec3(0), 0.9 * fwidth(corner), corner);\n",
    "    if (inside) discard;\n", /* the far side would clutter the gaps of the near one */
    "    lit *= mix(0.5, 1.0, min(near.x, min(near.y, near.z)));\n",
    "  }\n",
    "  if (brush.w > 0.0) {\n",
    "    float r = length(place - brush.xyz) / brush.w, width = 1.5 * fwidth(r), q = max(0.0, 1.0 - r * r);\n",
    "    lit = mix(lit, vec3(1.0, 0.55, 0.1), 0.35 * q * q);\n",
    "    lit = mix(lit, vec3(1.0, 0.45, 0.0), 0.8 * (1.0 - smoothstep(0.5 * width, width, abs(r - 1.0))));\n",
    "  }\n",
    "  result = vec4(lit, 1);\n",
    "}\n",
};

/* A quadrilateral in clip coordinates, in one color or with a picture that is transparent where it is dark. */
static const char *const viewer_flat_vertex[] = {
    VIEWER_GLSL,
    "uniform vec2 corners[4];\n", /* lower left, lower right, upper left, upper right */
    "out vec2 where;\n",
    "void main() {\n",
    "  where = vec2(gl_VertexID % 2, 1 - gl_VertexID / 2);\n",
    "  gl_Position = vec4(corners[gl_VertexID], 0, 1);\n",
    "}\n",
};

static const char *const viewer_flat_fragment[] = {
    VIEWER_GLSL,
    "in vec2 where;\n",
    "uniform sampler2D picture;\n",
    "uniform bool textured;\n",
    "uniform vec4 color;\n",
    "out vec4 result;\n",
    "void main() {\n",
    "  vec3 ink = texture(picture, where).rgb;\n",
    "  result = textured ? vec4(ink, mix(0.72, 1.0, max(ink.r, max(ink.g, ink.b)))) : color;\n",
    "}\n",
};

#endif
