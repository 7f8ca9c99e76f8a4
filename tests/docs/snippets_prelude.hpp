// SPDX-License-Identifier: MIT
// What the reader of a page has at hand where a snippet begins. See blocks.py.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <map>
#include <set>
#include <span>
#include <thread>
#include <unordered_map>
#include <utility>
#include <vector>

#include <jostle/jostle.hpp>

extern std::vector<jostle::Aabb3f> boxes, new_boxes, bullets, targets;
extern std::vector<std::uint32_t> ids;
extern jostle::Aabb3f box, new_box, region, door_box, player_box;
extern jostle::Vec3f eye, direction;
extern std::vector<jostle::Vec3f> at;
extern std::vector<float> radii;
extern jostle::World3f world;
extern jostle::ObjectId ghost;
extern std::vector<jostle::ObjectId> others;
extern std::vector<jostle::Shape3> shapes;
extern std::vector<jostle::Pose3f> poses;
extern jostle::ContactFinder3f finder;
extern jostle::ContactBuffer<3, float> now, last;
extern jostle::PairBuffer pairs;
struct Impulse
{
    float x = 0, y = 0, z = 0;
    Impulse& operator+=(const Impulse& other);
};
extern Impulse impulse, opposite;
extern std::uint32_t objects;
extern jostle::Responses<Impulse> responses;

void match(const jostle::ContactBuffer<3, float>& now, const jostle::ContactBuffer<3, float>& last);
void open_door();
template <class... Values>
void use(const Values&...);
