#include "meshing/outline.h"

#include <algorithm>

namespace dtsdf {
namespace {

/// A nonlinear hash, since sums of linear hashes would cancel out where the indices of two fans'
/// end vertices differ by the same amount, as on a grid.
uint32_t hash(uint32_t number) {
  const uint32_t product = number * 0x9e3779b9u;
  return product ^ (product >> 15);
}

}  // namespace

void Outline::addTriangle(const Triangle& triangle) {
  const uint32_t hashes[3] = {hash(triangle[0]), hash(triangle[1]), hash(triangle[2])};
  for (int k = 0; k < 3; ++k) {
    Vertex& vertex = at(triangle[k]);
    vertex.sum += hashes[(k + 1) % 3] - hashes[(k + 2) % 3];
    ++vertex.triangles;
  }
}

size_t Outline::rimFrom(uint32_t vertex) const {
  const auto isBelow = [](const Rim& rim, uint32_t number) { return rim.vertex < number; };
  return static_cast<size_t>(std::lower_bound(rims_.begin(), rims_.end(), vertex, isBelow) -
                             rims_.begin());
}

void Outline::forget(uint32_t first) {
  const size_t rims = rimFrom(first);
  rims_.erase(rims_.begin(), rims_.begin() + static_cast<std::ptrdiff_t>(rims));
  first_rim_ += static_cast<uint32_t>(rims);
  std::vector<Link> kept;
  for (Rim& rim : rims_) {
    const Link* const links = linksOf(rim);
    rim.first_link = static_cast<uint32_t>(kept.size());
    kept.insert(kept.end(), links, links + rim.links);
  }
  links_.swap(kept);
  vertices_.erase(vertices_.begin(), vertices_.begin() + (first - first_));
  first_ = first;
}

void Outline::link(uint32_t first, uint32_t end, const std::vector<Triangle>& triangles) {
  const size_t first_new = rims_.size();
  auto links = static_cast<uint32_t>(links_.size());
  for (uint32_t i = first; i < end; ++i) {
    Vertex& vertex = at(i);
    const bool is_inside = vertex.sum == 0 && vertex.kind != Kind::kMiddle;
    if (is_inside || vertex.kind == Kind::kFixed) continue;
    vertex.rim = first_rim_ + static_cast<uint32_t>(rims_.size());
    rims_.push_back({i, links});
    links += vertex.triangles;
  }
  links_.resize(links);
  for (const Triangle& t : triangles) {
    if ((at(t[0]).rim & at(t[1]).rim & at(t[2]).rim) == kNone) continue;  // the usual case
    for (int k = 0; k < 3; ++k) {
      if (t[k] < first || t[k] >= end || !hasRim(t[k])) continue;
      Rim& rim = rims_[rimNumber(t[k])];
      links_[rim.first_link + rim.own++] = {t[(k + 1) % 3], t[(k + 2) % 3]};
    }
  }
  for (size_t n = first_new; n < rims_.size(); ++n) {
    Rim& rim = rims_[n];
    rim.links = rim.own;
    if (!isOnOutline(rim.vertex)) continue;
    rim.fan_count = findFans(rim, rim.fans);
    if (rim.fan_count == 1) rim.beside = rim.fans[0];
  }
}

/// Finds the fans formed by all links, including those of patches. @return the number of fans; 0 if
/// there are more than two.
uint32_t Outline::findFans(const Rim& rim, std::array<Rim::Fan, 2>& fans) const {
  const Link* const begin = linksOf(rim);
  const Link* const end = begin + rim.links;
  uint32_t count = 0;
  for (const Link* link = begin; link != end; ++link) {
    const Link* before = begin;
    while (before != end && before->previous != link->next) ++before;
    if (before != end) continue;
    if (count == 2) return 0;
    uint32_t last = link->previous;
    for (uint32_t steps = 0; steps < rim.links; ++steps) {
      const Link* next = begin;
      while (next != end && next->next != last) ++next;
      if (next == end) break;
      last = next->previous;
    }
    fans[count++] = {link->next, last};
  }
  return count;
}

void Outline::clear(uint32_t vertex) {
  at(vertex).triangles = 0;
  if (!hasRim(vertex)) return;
  Rim& rim = rims_[rimNumber(vertex)];
  rim.fan_count = 0;
  rim.beside = {kNone, kNone};
}

void Outline::patch(const Triangle& triangle) {
  for (int k = 0; k < 3; ++k) {
    Rim& rim = rims_[rimNumber(triangle[k])];
    if (rim.first_link + rim.links != links_.size()) {  // moves the links to the end
      const auto first = static_cast<uint32_t>(links_.size());
      for (uint32_t n = 0; n < rim.links; ++n) links_.push_back(Link(links_[rim.first_link + n]));
      rim.first_link = first;
    }
    links_.push_back({triangle[(k + 1) % 3], triangle[(k + 2) % 3]});
    ++rim.links;
    std::array<Rim::Fan, 2> fans;
    rim.beside = findFans(rim, fans) == 1 ? fans[0] : Rim::Fan{kNone, kNone};
  }
}

bool Outline::hasEdge(uint32_t a, uint32_t b) const {
  const Rim& rim = rimOf(a);
  const Link* const links = linksOf(rim);
  return std::any_of(links, links + rim.own,
                     [b](const Link& link) { return link.next == b || link.previous == b; });
}

}  // namespace dtsdf
