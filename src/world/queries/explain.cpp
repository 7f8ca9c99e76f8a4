// SPDX-License-Identifier: MIT
// Describes a world for people, as text and as a drawing.
#include <locale>
#include <sstream>
#include <string>

#include "base/instantiate.hpp"
#include "world/implementation.hpp"

JOSTLE_NAMESPACE_BEGIN

template <int Dim, Coordinate T>
std::string World<Dim, T>::explain() const
{
    const WorldStats& s = stats();
    std::ostringstream text;
    text.imbue(std::locale::classic());
    text.precision(3);
    const auto percent = [](std::uint64_t part, std::uint64_t of) {
        return of == 0 ? 0.0 : 100 * static_cast<double>(part) / static_cast<double>(of);
    };
    if (implementation_->follows) text << "A view of another world. ";
    text << s.objects << " objects: " << s.resting << " at rest, " << s.active << " active, " << s.disabled
         << " disabled; " << s.bytes_reserved / 1024 << " KiB.\n";
    if (implementation_->follows) return text.str();
    text << "The last update took " << s.us_total << " us: " << s.us_apply << " applying " << s.commands
         << " commands, " << s.us_active << " among active objects, " << s.us_resting
         << " between active and resting ones, " << s.us_events << " comparing them with those before, "
         << s.us_index << " for the index.\n";
    text << s.changed << " objects changed (" << s.woken << " woke up), " << s.settled << " came to rest; "
         << s.began << " pairs began, " << s.persisted << " persisted, " << s.ended << " ended.\n";
    text << "Of " << s.candidates << " candidates " << percent(s.false_positives, s.candidates)
         << "% were kept apart by filters.\n";
    if (s.dropped != 0)
        text << s.dropped << " commands were about objects that had been removed before their turn.\n";
    if (s.contested != 0)
        text << s.contested
             << " objects had commands from several threads, of which one may have overruled another.\n";
    if (s.refused != 0) text << s.refused << " touching pairs are refused by accept.\n";
    if (s.candidates > 1000 && 2 * s.false_positives > s.candidates)
        text << "Slow because: filters reject most of what touches.\n";
    if (s.changed > 0 && s.persisted + s.began > 64 * s.changed)
        text << "Slow because: objects that moved touch " << (s.persisted + s.began) / s.changed
             << " others on average. A few giant boxes, or piles of boxes in one place; filter what needn't "
                "be known.\n";
    if (s.active > 1000 && s.active > 4 * s.changed)
        text << "For a while: " << s.active - s.changed
             << " objects stopped moving lately and come to rest bit by bit.\n";
    return text.str();
}

template <int Dim, Coordinate T>
void World<Dim, T>::draw(
    FunctionRef<void(const Box& box, DrawKind kind)> draw_box,
    FunctionRef<void(const Vector& from, const Vector& to, DrawKind kind)> draw_line) const
{
    const Implementation& me = *implementation_;
    const Users::Answering answering(&me.users);
    if (draw_box)
        for (std::uint32_t i = 0; i < index_end(); ++i) {
            const auto object = me.state.objects[world::Index{i}];
            if (!object.has(world::flag::alive)) continue;
            const bool is_shown = me.state.is_shown(world::Index{i});
            draw_box(object.now(), !is_shown                                    ? DrawKind::disabled
                                   : me.state.is_shown_resting(world::Index{i}) ? DrawKind::resting
                                                                                : DrawKind::active);
        }
    if (!draw_line) return;
    const auto line = [&](std::uint32_t a, std::uint32_t b, DrawKind kind) {
        T centre[2][Dim];
        for (int d = 0; d < Dim; ++d)
            for (int k = 0; k < 2; ++k) {
                const Box& box = me.state.objects[world::Index{k == 0 ? a : b}].now();
                // A box that is infinite both ways has no centre.
                centre[k][d] = box.lo[d] == -box.hi[d] ? T{0} : box.lo[d] / 2 + box.hi[d] / 2;
            }
        draw_line(centre[0], centre[1], kind);
    };
    for (const ObjectPair& pair : began())
        line(pair.a.index, pair.b.index, DrawKind::began);
    for (const Pair& pair : persisted())
        line(pair.a, pair.b, DrawKind::persisted);
    for (const EndedPair& pair : ended())
        if (contains(pair.a) && contains(pair.b)) line(pair.a.index, pair.b.index, DrawKind::ended);
}

#define JOSTLE_INSTANTIATE(Dim, T)                                                                           \
    template JOSTLE_API std::string World<Dim, T>::explain() const;                                          \
    template JOSTLE_API void World<Dim, T>::draw(FunctionRef<void(const Box&, DrawKind)>,                    \
                                                 FunctionRef<void(const Vector&, const Vector&, DrawKind)>)  \
        const;
JOSTLE_FOR_EACH_SPACE(JOSTLE_INSTANTIATE)
#undef JOSTLE_INSTANTIATE

JOSTLE_NAMESPACE_END
