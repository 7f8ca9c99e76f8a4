// Everything is drawn from one texture of boxes, laid out as the library reads them: lo and hi, three numbers
// each. A box is three texels with two numbers each. Pairs, in another texture, are the library's own result:
// two numbers of boxes.
import { bodiesPerRow, boxesPerRow, contactsPerRow, pairsPerRow } from "./messages";

/**
 * So many boxes are drawn as one instance. An instance for each would be the plain way, but processors that
 * draw, and some graphics cards, take as long for an instance of six triangles as for one of hundreds.
 */
export const batch = 256;

const numberInBatch = /* glsl */ `
int number() { return gl_InstanceID * ${batch} + gl_VertexID / 12; }
const vec4 nowhere = vec4(2, 2, 2, 1);
`;

const boxAt = /* glsl */ `
uniform highp sampler2D boxes;
void boxAt(int box, out vec3 lo, out vec3 hi)
{
    ivec2 at = ivec2(3 * (box % ${boxesPerRow}), box / ${boxesPerRow});
    vec2 a = texelFetch(boxes, at, 0).rg;
    vec2 b = texelFetch(boxes, at + ivec2(1, 0), 0).rg;
    vec2 c = texelFetch(boxes, at + ivec2(2, 0), 0).rg;
    lo = vec3(a, b.x);
    hi = vec3(b.y, c);
}
`;

// Three faces of a box are enough: those that look at the camera. 'corner' is 1 on the near side of each
// axis, 0 on the far side; 'face' is the axis that a face is across.
const nearFaces = /* glsl */ `
out vec3 place;
out vec2 onFace;
flat out vec3 normal;
out float distanceTo;
vec4 nearCorner(vec3 lo, vec3 hi)
{
    vec3 above = step((lo + hi) * 0.5, cameraPosition);
    place = mix(lo, hi, mix(1.0 - above, above, position));
    onFace = face < 0.5 ? position.yz : face < 1.5 ? position.zx : position.xy;
    normal = face < 0.5 ? vec3(1, 0, 0) : face < 1.5 ? vec3(0, 1, 0) : vec3(0, 0, 1);
    normal *= 2.0 * above - 1.0;
    vec4 seen = modelViewMatrix * vec4(place, 1);
    distanceTo = -seen.z;
    return projectionMatrix * seen;
}
`;

const fragmentHead = /* glsl */ `
precision highp float;
in vec3 place;
in vec2 onFace;
flat in vec3 normal;
in float distanceTo;
uniform vec4 cut; // shown is what lies where cut.xyz . place <= cut.w
uniform vec2 fog; // where it begins and where it ends
uniform vec3 air; // the colour of the background
out vec4 colour;
float haze() { return clamp((distanceTo - fog.x) / (fog.y - fog.x), 0.0, 1.0); }
float light() { return 0.66 + 0.34 * dot(normal, normalize(vec3(0.25, 0.9, 0.5))); }
// 1 on the edges of a face, about a pixel wide.
float edge()
{
    vec2 pixel = max(fwidth(onFace), vec2(1e-6));
    vec2 away = min(onFace, 1.0 - onFace) / pixel;
    float seen = 1.0 - smoothstep(0.12, 0.4, max(pixel.x, pixel.y)); // none where a face is some pixels wide
    return seen * (1.0 - smoothstep(0.4, 1.4, min(away.x, away.y)));
}
`;

const vertexHead = /* glsl */ `
precision highp float;
precision highp int;
uniform mat4 modelViewMatrix, projectionMatrix;
uniform vec3 cameraPosition;
in vec3 position;
in float face;
`;

/** All bodies, as thin glass. */
export const bodies = {
  vertex:
    vertexHead +
    numberInBatch +
    boxAt +
    nearFaces +
    /* glsl */ `
uniform int boxCount;
void main()
{
    vec3 lo, hi;
    boxAt(min(number(), boxCount - 1), lo, hi);
    gl_Position = number() < boxCount ? nearCorner(lo, hi) : nowhere;
}`,
  fragment:
    fragmentHead +
    /* glsl */ `
uniform vec3 glass;
uniform float opacity;
void main()
{
    if (dot(cut.xyz, place) > cut.w) discard;
    float near = 1.0 - haze();
    float lines = edge() * min(0.55, opacity * 7.0) * near * near;
    colour = vec4(glass * light(), opacity * (0.3 + 0.7 * near) + lines);
}`,
};

/** What each pair has in common, lit. */
export const overlaps = {
  vertex:
    vertexHead +
    numberInBatch +
    boxAt +
    nearFaces +
    /* glsl */ `
uniform highp usampler2D pairs;
uniform int pairCount, chosen;
uniform float large; // what is longer along every axis would hide the scene
flat out float depth;
flat out int veiled;
void main()
{
    int at = min(number(), pairCount - 1);
    uvec2 pair = texelFetch(pairs, ivec2(at % ${pairsPerRow}, at / ${pairsPerRow}), 0).rg;
    vec3 loA, hiA, loB, hiB;
    boxAt(int(pair.x), loA, hiA);
    boxAt(int(pair.y), loB, hiB);
    vec3 lo = max(loA, loB), hi = min(hiA, hiB);
    vec3 size = min(hiA - loA, hiB - loB), part = (hi - lo) / max(size, vec3(1e-20));
    depth = min(part.x, min(part.y, part.z)); // 0: they just touch; 1: one is as deep as it can be
    veiled = all(greaterThan(hi - lo, vec3(large))) ? 1 : 0;
    // What has no thickness is drawn as if it had some.
    vec3 least = vec3(0.0008 * distance(cameraPosition, lo));
    vec3 more = max(least - (hi - lo), 0.0) * 0.5;
    gl_Position = nearCorner(lo - more, hi + more);
    // Where somebody looks at one box, other pairs would hide it.
    bool hidden = chosen >= 0 && int(pair.x) != chosen && int(pair.y) != chosen;
    if (hidden || number() >= pairCount) gl_Position = nowhere;
}`,
  fragment:
    fragmentHead +
    /* glsl */ `
flat in float depth;
flat in int veiled;
uniform vec3 shallow, middle, deep;
void main()
{
    if (dot(cut.xyz, place) > cut.w) discard;
    // A veil is every eighth pixel, so that it needs no order in which to be drawn, and its edges.
    ivec2 at = ivec2(gl_FragCoord.xy);
    if (veiled != 0 && edge() < 0.3 && (at.x + 3 * at.y) % 8 != 0) discard;
    vec3 hot = depth < 0.5 ? mix(shallow, middle, depth * 2.0) : mix(middle, deep, depth * 2.0 - 1.0);
    hot *= light() * (1.0 - 0.45 * edge());
    colour = vec4(mix(hot, air, 0.75 * haze()), 1);
}`,
};

/** A few boxes that somebody looks at: the chosen one and those that it touches. */
export const chosen = {
  vertex:
    vertexHead +
    boxAt +
    nearFaces +
    /* glsl */ `
uniform int chosen;
in uint box;
flat out float first;
void main()
{
    vec3 lo, hi;
    boxAt(int(box), lo, hi);
    first = int(box) == chosen ? 1.0 : 0.0;
    gl_Position = nearCorner(lo, hi);
}`,
  fragment:
    fragmentHead +
    /* glsl */ `
flat in float first;
uniform vec3 one, partner;
void main()
{
    vec3 tint = mix(partner, one, first);
    colour = vec4(tint * light(), mix(0.16, 0.34, first) + 0.6 * edge());
}`,
};

/** The glass box that follows the pointer. */
export const probe = {
  vertex:
    vertexHead +
    nearFaces +
    /* glsl */ `
uniform vec3 probeLo, probeHi;
void main() { gl_Position = nearCorner(probeLo, probeHi); }`,
  fragment:
    fragmentHead +
    /* glsl */ `
uniform vec3 one;
void main() { colour = vec4(one * light(), 0.14 + 0.8 * edge()); }`,
};

/** Bodies as they are, one kind of shape in each draw call: corners are those of a shape of size 1. */
export const solids = {
  vertex: /* glsl */ `
precision highp float;
precision highp int;
uniform mat4 modelViewMatrix, projectionMatrix;
uniform highp sampler2D poses;
in vec3 position, normal;
in float kind;
out vec3 place;
out vec3 facing;
out float distanceTo;
vec3 turned(vec3 v, vec4 q) { return v + 2.0 * cross(q.xyz, cross(q.xyz, v) + q.w * v); }
void main()
{
    ivec2 at = ivec2(5 * (gl_InstanceID % ${bodiesPerRow}), gl_InstanceID / ${bodiesPerRow});
    vec2 a = texelFetch(poses, at, 0).rg, b = texelFetch(poses, at + ivec2(1, 0), 0).rg;
    vec2 c = texelFetch(poses, at + ivec2(2, 0), 0).rg, d = texelFetch(poses, at + ivec2(3, 0), 0).rg;
    vec4 rotation = vec4(b.y, c, d.x);
    place = vec3(a, b.x) + d.y * turned(position, rotation);
    facing = turned(normal, rotation);
    vec4 seen = modelViewMatrix * vec4(place, 1);
    distanceTo = -seen.z;
    bool other = texelFetch(poses, at + ivec2(4, 0), 0).r != kind;
    gl_Position = other ? vec4(2, 2, 2, 1) : projectionMatrix * seen;
}`,
  fragment: /* glsl */ `
precision highp float;
in vec3 place;
in vec3 facing;
in float distanceTo;
uniform vec4 cut;
uniform vec2 fog;
uniform vec3 air, solid;
out vec4 colour;
void main()
{
    if (dot(cut.xyz, place) > cut.w) discard;
    float light = 0.62 + 0.38 * dot(normalize(facing), normalize(vec3(0.25, 0.9, 0.5)));
    float haze = clamp((distanceTo - fog.x) / (fog.y - fog.x), 0.0, 1.0);
    colour = vec4(mix(solid * light, air, 0.8 * haze), 1);
}`,
};

/** The cloth, lit where it is near itself; and, never lit, the ball and the floor under it. */
export const cloth = {
  vertex: /* glsl */ `
precision highp float;
uniform mat4 modelViewMatrix, projectionMatrix;
in vec3 position, normal;
in float nearness;
out vec3 place;
out vec3 facing;
out float lit;
void main()
{
    place = position;
    facing = normal;
    lit = nearness;
    gl_Position = projectionMatrix * modelViewMatrix * vec4(position, 1);
}`,
  fragment: /* glsl */ `
precision highp float;
in vec3 place;
in vec3 facing;
in float lit;
uniform vec4 cut;
uniform vec3 air, glass, solid, shallow, middle, deep;
out vec4 colour;
void main()
{
    if (dot(cut.xyz, place) > cut.w) discard;
    vec3 up = normalize(facing) * (gl_FrontFacing ? 1.0 : -1.0);
    float light = 0.62 + 0.38 * dot(up, normalize(vec3(0.25, 0.9, 0.5)));
    vec3 hot = lit < 0.5 ? mix(shallow, middle, 2.0 * lit) : mix(middle, deep, 2.0 * lit - 1.0);
    vec3 plain = lit < 0.0 ? mix(air, solid, 0.4) : gl_FrontFacing ? glass : mix(glass, solid, 0.6);
    colour = vec4(mix(plain, hot, smoothstep(0.0, 0.5, lit)) * light, 1);
}`,
};

/** Points of contact: each a needle that begins there and goes along the normal, drawn over what hides it. */
export const needles = {
  vertex: /* glsl */ `
precision highp float;
precision highp int;
uniform mat4 modelViewMatrix, projectionMatrix;
uniform highp sampler2D contacts;
uniform int contactCount;
uniform float needle; // how long they are
uniform vec2 pixel; // the size of one, of what is 2 wide
uniform vec2 fog;
uniform vec4 cut;
in vec3 position; // x along the needle, y across
out float shade;
void main()
{
    int number = gl_InstanceID * ${batch} + gl_VertexID / 4;
    int known = min(number, contactCount - 1);
    ivec2 at = ivec2(4 * (known % ${contactsPerRow}), known / ${contactsPerRow});
    vec2 a = texelFetch(contacts, at, 0).rg, b = texelFetch(contacts, at + ivec2(1, 0), 0).rg;
    vec3 from = vec3(a, b.x), normal = vec3(b.y, texelFetch(contacts, at + ivec2(2, 0), 0).rg);
    vec4 begin = projectionMatrix * modelViewMatrix * vec4(from, 1);
    vec4 end = projectionMatrix * modelViewMatrix * vec4(from + needle * normal, 1);
    vec4 here = mix(begin, end, position.x);
    vec2 along = (end.xy / end.w - begin.xy / begin.w) / pixel;
    vec2 across = length(along) > 0.01 ? normalize(vec2(-along.y, along.x)) : vec2(1, 0);
    here.xy += across * position.y * pixel * here.w;
    shade = 1.0 - 0.8 * clamp((begin.w - fog.x) / (fog.y - fog.x), 0.0, 1.0);
    bool shown = number < contactCount && begin.w > 0.0 && end.w > 0.0 && dot(cut.xyz, from) <= cut.w;
    gl_Position = shown ? here : vec4(2, 2, 2, 1);
}`,
  fragment: /* glsl */ `
precision highp float;
in float shade;
uniform vec3 contact;
out vec4 colour;
void main() { colour = vec4(contact, shade); }`,
};

/** Bricks and the records in one of them, as the lines of their edges. */
export const bricks = {
  vertex: /* glsl */ `
precision highp float;
uniform mat4 modelViewMatrix, projectionMatrix;
in vec3 position;
in vec3 lo, hi;
// Of the records of the fullest brick; 2: bright; 3: a record; 4: one that is compared; 5: the box's.
in float share;
flat out float full;
out vec3 place;
void main()
{
    full = share;
    place = mix(lo, hi, position);
    gl_Position = projectionMatrix * modelViewMatrix * vec4(place, 1);
}`,
  fragment: /* glsl */ `
precision highp float;
flat in float full;
in vec3 place;
uniform vec4 cut;
uniform vec3 few, many, record, one;
out vec4 colour;
void main()
{
    if (dot(cut.xyz, place) > cut.w) discard;
    colour = full > 4.5 ? vec4(one, 1)
        : full > 3.5 ? vec4(record, 0.9)
        : full > 2.5 ? vec4(record, 0.13)
        : full > 1.5 ? vec4(many, 1)
        : vec4(mix(few, many, full), 0.25 + 0.45 * full);
}`,
};
