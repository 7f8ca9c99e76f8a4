// SPDX-License-Identifier: MIT
#include "index/tree.hpp"

#include <algorithm>

JOSTLE_NAMESPACE_BEGIN
namespace index {

template <int Dim, class T>
Tree<Dim, T>::Tree(const FinderOptions&)
{
}

template <int Dim, class T>
void Tree<Dim, T>::insert(std::span<const std::uint32_t> ids, const BoxView<Dim, T>& boxes)
{
    std::size_t end = here_.size();
    for (const std::uint32_t id : ids)
        end = std::max<std::size_t>(end, std::size_t{id} + 1);
    box_.resize(end);
    here_.resize(end);
    for (std::size_t i = 0; i < ids.size(); ++i) {
        box_[ids[i]] = boxes[i];
        here_[ids[i]] = 1;
    }
    size_ += ids.size();
}

template <int Dim, class T>
void Tree<Dim, T>::erase(std::span<const std::uint32_t> ids) noexcept
{
    for (const std::uint32_t id : ids)
        here_[id] = 0;
    size_ -= ids.size();
}

template <int Dim, class T>
void Tree<Dim, T>::move(std::span<const std::uint32_t> ids, const BoxView<Dim, T>& boxes)
{
    for (std::size_t i = 0; i < ids.size(); ++i)
        box_[ids[i]] = boxes[i];
}

template <int Dim, class T>
void Tree<Dim, T>::clear() noexcept
{
    here_.clear();
    size_ = 0;
}

template class Tree<2, float>;
template class Tree<2, double>;
template class Tree<3, float>;
template class Tree<3, double>;

} // namespace index
JOSTLE_NAMESPACE_END
