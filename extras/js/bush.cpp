// SPDX-License-Identifier: MIT
// Rectangles by number in an index, for jostle/rbush and jostle/flatbush: called once for each rectangle and
// each search, so that a call is little more than its arguments.

#include <cstddef>
#include <cstdint>
#include <numeric>
#include <span>
#include <vector>

#include "extras/js/module.hpp"
#include "jostle/box_index.hpp"

namespace {

/// As c_api::guarded, without what it does about callbacks, of which there are none: these calls are short.
template <class F>
jostle_status guarded(jostle_error* error, F&& inside) noexcept
{
    try {
        inside();
        return JOSTLE_OK;
    } catch (...) {
        return jostle::c_api::report(error);
    }
}

using Rectangle = jostle::Aabb<2, double>;

/// Changes are kept until the next question: then many become one call of the index, or a new index.
class Bush
{
  public:
    /// What JavaScript reads.
    struct View
    {
        std::uint32_t count = 0; ///< answers of the last question
        const std::uint32_t* answers = nullptr;
        Rectangle* rectangles = nullptr; ///< by number
    };
    [[nodiscard]] const View& view() const { return view_; }

    void put(std::uint32_t number, const Rectangle& rectangle)
    {
        if (number >= state_.size()) {
            rectangles_.resize(number + 1);
            state_.resize(number + 1, 0);
        }
        note(number);
        rectangles_[number] = rectangle;
        if ((state_[number] & there) == 0) ++size_;
        state_[number] |= there;
    }
    void drop(std::uint32_t number)
    {
        note(number);
        if ((state_[number] & there) != 0) --size_;
        state_[number] = static_cast<std::uint8_t>(state_[number] & ~there);
    }
    /// Forgets all. Makes room for so many, which are there from now on: `view().rectangles`, to be written.
    void load(std::uint32_t count)
    {
        clear();
        rectangles_.resize(count);
        changed_.resize(count);
        state_.assign(count, there | noted);
        std::iota(changed_.begin(), changed_.end(), 0U);
        size_ = count;
        show();
    }
    void clear()
    {
        index_.clear();
        rectangles_.clear();
        state_.clear();
        changed_.clear();
        size_ = 0;
        view_ = {};
    }
    void search(const Rectangle& rectangle)
    {
        apply();
        index_.all(rectangle, answers_);
        show();
    }
    /// All, those that are near each other together.
    void order()
    {
        apply();
        answers_.clear();
        if (const auto bounds = index_.bounds())
            index_.visit(*bounds, [this](std::uint32_t number) { return answers_.push_back(number), true; });
        show();
    }
    /// One answer, whose number doesn't count, or none.
    void any(const Rectangle& rectangle)
    {
        apply();
        answers_.assign(index_.any(rectangle) ? 1 : 0, 0);
        show();
    }
    void nearest(const jostle::Nearest<2, double>& query)
    {
        apply();
        index_.nearest(query, hits_);
        answers_.clear();
        for (const auto& hit : hits_)
            answers_.push_back(hit.id);
        show();
    }

  private:
    enum State : std::uint8_t
    {
        there = 1,   ///< by the caller's word
        indexed = 2, ///< the index has it, maybe as it was
        noted = 4    ///< in `changed_`
    };

    void note(std::uint32_t number)
    {
        if ((state_[number] & noted) != 0) return;
        changed_.push_back(number);
        state_[number] |= noted;
    }
    void show()
    {
        view_ = {static_cast<std::uint32_t>(answers_.size()), answers_.data(), rectangles_.data()};
    }

    /// Calls change(numbers, rectangles) with those of `from` whose state, but for `noted`, is `was`.
    template <class Numbers, class Change>
    void pick(const Numbers& from, std::uint8_t was, Change change)
    {
        numbers_.clear();
        picked_.clear();
        for (const std::uint32_t number : from)
            if ((state_[number] & ~noted) == was) {
                numbers_.push_back(number);
                picked_.push_back(rectangles_[number]);
            }
        if (!numbers_.empty()) change();
    }

    /// After an exception in between, the states tell what is left to do.
    void apply()
    {
        if (changed_.empty()) return;
        if (changed_.size() >= size_ / 8) {
            build();
        } else {
            pick(changed_, indexed, [this] {
                index_.erase(numbers_);
                for (const std::uint32_t number : numbers_)
                    state_[number] = noted;
            });
            pick(changed_, there | indexed, [this] { index_.move(numbers_, std::span(picked_)); });
            pick(changed_, there, [this] {
                index_.insert(numbers_, std::span(picked_));
                for (const std::uint32_t number : numbers_)
                    state_[number] |= indexed;
            });
        }
        for (const std::uint32_t number : changed_)
            state_[number] = static_cast<std::uint8_t>(state_[number] & ~noted);
        changed_.clear();
    }
    void build()
    {
        if (size_ == rectangles_.size()) {
            index_.build(std::span(rectangles_));
        } else {
            numbers_.clear();
            picked_.clear();
            for (std::uint32_t number = 0; number < state_.size(); ++number)
                if ((state_[number] & there) != 0) {
                    numbers_.push_back(number);
                    picked_.push_back(rectangles_[number]);
                }
            index_.build(numbers_, std::span(picked_));
        }
        for (std::uint8_t& state : state_)
            state = static_cast<std::uint8_t>((state & ~indexed) | ((state & there) != 0 ? indexed : 0));
    }

    View view_;
    jostle::BoxIndex<2, double> index_;
    std::vector<Rectangle> rectangles_; // by number, as `state_`
    std::vector<std::uint8_t> state_;
    std::size_t size_ = 0; // how many are there
    std::vector<std::uint32_t> changed_;
    std::vector<std::uint32_t> numbers_; // working memory of apply()
    std::vector<Rectangle> picked_;
    std::vector<jostle::Hit<double>> hits_;
    std::vector<std::uint32_t> answers_;
};

} // namespace

/// It begins with a Bush::View.
JOSTLE_JS jostle_status jostle_js_bush_new(Bush** out, jostle_error* error)
{
    return guarded(error, [&] { *out = new Bush; });
}
JOSTLE_JS void jostle_js_bush_free(Bush* bush)
{
    delete bush;
}
JOSTLE_JS void jostle_js_bush_clear(Bush* bush)
{
    bush->clear();
}
/// The rectangle `number` is from now on this one, which has no NaN and lower bounds up to the upper ones.
/// Numbers are dense.
JOSTLE_JS jostle_status jostle_js_bush_put(Bush* bush, std::uint32_t number, double min_x, double min_y,
                                           double max_x, double max_y, jostle_error* error)
{
    return guarded(error, [&] { bush->put(number, {{min_x, min_y}, {max_x, max_y}}); });
}
/// Forgets all, and takes so many rectangles, which the caller writes before any other call.
JOSTLE_JS jostle_status jostle_js_bush_load(Bush* bush, std::uint32_t count, jostle_error* error)
{
    return guarded(error, [&] { bush->load(count); });
}
/// It was put.
JOSTLE_JS jostle_status jostle_js_bush_drop(Bush* bush, std::uint32_t number, jostle_error* error)
{
    return guarded(error, [&] { bush->drop(number); });
}
JOSTLE_JS jostle_status jostle_js_bush_search(Bush* bush, double min_x, double min_y, double max_x,
                                              double max_y, jostle_error* error)
{
    return guarded(error, [&] { bush->search({{min_x, min_y}, {max_x, max_y}}); });
}
JOSTLE_JS jostle_status jostle_js_bush_order(Bush* bush, jostle_error* error)
{
    return guarded(error, [&] { bush->order(); });
}
JOSTLE_JS jostle_status jostle_js_bush_any(Bush* bush, double min_x, double min_y, double max_x, double max_y,
                                           jostle_error* error)
{
    return guarded(error, [&] { bush->any({{min_x, min_y}, {max_x, max_y}}); });
}
JOSTLE_JS jostle_status jostle_js_bush_nearest(Bush* bush, double x, double y, std::uint32_t count,
                                               double max_distance, jostle_error* error)
{
    return guarded(error, [&] { bush->nearest({{x, y}, count, max_distance}); });
}
