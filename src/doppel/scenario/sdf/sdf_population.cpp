#include "doppel/scenario/sdf/detail/sdf_population.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>

#include "doppel/base/core/names.h"

namespace doppel::sdf {
namespace {

struct Region {
  Eigen::Vector3d size = Eigen::Vector3d::Ones();  // m, of the box or around the cylinder
  bool round = false;

  // u: each from 0 to 1.
  [[nodiscard]] Eigen::Vector3d at(const Eigen::Vector3d& u) const {
    if (!round) return size.cwiseProduct(u - Eigen::Vector3d::Constant(0.5));
    const double radius = 0.5 * size.x() * std::sqrt(u.x()), angle = 2 * std::numbers::pi * u.y();
    return {radius * std::cos(angle), radius * std::sin(angle), size.z() * (u.z() - 0.5)};
  }
};

Region region_of(const XmlNode& node, Elements& elements) {
  Region out;
  if (const XmlNode* const box = node.first("box")) {
    out.size = elements.vector<3>(*box, "size").value_or(out.size);
  } else if (const XmlNode* const cylinder = node.first("cylinder")) {
    const double across = 2 * elements.number_or(*cylinder, "radius", 1);
    out.size = {across, across, elements.number_or(*cylinder, "length", 1)};
    out.round = true;
  }
  return out;
}

// The i-th point of Halton's sequence, whose first points cover a region evenly.
double halton(int i, int base) {
  double out = 0, share = 1;
  for (; i > 0; i /= base) {
    share /= base;
    out += share * (i % base);
  }
  return out;
}

// The number of copies that an element gives, from `least`; nullopt: an error that is reported.
std::optional<int> count_of(const XmlNode& node, const char* name, int least, Elements& elements) {
  const double wanted = elements.number_or(node, name, 1);
  if (wanted >= least && wanted <= kMaxPopulation && wanted == std::floor(wanted))
    return static_cast<int>(wanted);
  const XmlNode* const written = node.first(name);
  elements.error("sdf.value", written == nullptr ? node.where : written->where,
                 fmt::format("<{}> is {:g}; it must be a whole number from {} to {}", name, wanted, least,
                             kMaxPopulation));
  return std::nullopt;
}

std::optional<std::vector<Eigen::Vector3d>> grid_of(const XmlNode& distribution, Elements& elements) {
  const auto rows = count_of(distribution, "rows", 1, elements),
             columns = count_of(distribution, "cols", 1, elements);
  if (!rows || !columns) return std::nullopt;
  if (*rows * *columns > kMaxPopulation) {
    elements.error("sdf.value", distribution.where,
                   fmt::format("the grid has {} x {} places; a population has at most {}", *rows, *columns,
                               kMaxPopulation));
    return std::nullopt;
  }
  const Eigen::Vector3d step =
      elements.vector<3>(distribution, "step").value_or(Eigen::Vector3d(0.5, 0.5, 0));
  std::vector<Eigen::Vector3d> out;
  for (int row = 0; row < *rows; ++row) {
    for (int column = 0; column < *columns; ++column)
      out.emplace_back((column - 0.5 * (*columns - 1)) * step.x(), (row - 0.5 * (*rows - 1)) * step.y(), 0);
  }
  return out;
}

}  // namespace

std::optional<std::vector<Eigen::Vector3d>> population_places(const XmlNode& node, Elements& elements) {
  const XmlNode* const distribution = node.first("distribution");
  const std::string type = distribution == nullptr ? "random" : Elements::text(*distribution, "type");
  if (distribution != nullptr && type == "grid") return grid_of(*distribution, elements);
  const auto given = count_of(node, "model_count", 0, elements);
  if (!given) return std::nullopt;
  const int count = *given;
  const Region region = region_of(node, elements);
  const std::vector<std::string> lines{"linear-x", "linear-y", "linear-z"};
  std::vector<Eigen::Vector3d> out;
  if (const auto line = std::find(lines.begin(), lines.end(), type); line != lines.end()) {
    const auto axis = static_cast<Eigen::Index>(line - lines.begin());
    for (int i = 0; i < count; ++i)
      out.push_back(region.size[axis] * (count > 1 ? i / (count - 1.0) - 0.5 : 0) *
                    Eigen::Vector3d::Unit(axis));
  } else if (type == "uniform") {
    for (int i = 1; i <= count; ++i) out.push_back(region.at({halton(i, 2), halton(i, 3), halton(i, 5)}));
  } else if (type == "random" || type.empty()) {
    std::mt19937 random;  // the standard defines its values, unlike those of its distributions
    const auto share = [&random] { return random() / 4294967296.0; };
    for (int i = 0; i < count; ++i) {
      const double x = share(), y = share(), z = share();
      out.push_back(region.at({x, y, z}));
    }
  } else {
    const std::vector<std::string> known{"random", "uniform", "grid", "linear-x", "linear-y", "linear-z"};
    elements.error(
        "sdf.value", distribution->where,
        fmt::format("'{}' is not a distribution of a population{}", type, did_you_mean(type, known)));
    return std::nullopt;
  }
  return out;
}

}  // namespace doppel::sdf
