#pragma once
// Pairs of links whose visual shapes overlap where their collision shapes do not: the collision shapes are
// too small, or there are none.

#include <Eigen/Core>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "doppel/robot/collision/collision_scene.h"
#include "doppel/validation/checks/context.h"

namespace doppel {

inline constexpr std::string_view kTouchAtStart = "they touch at the start";  // as reach_scene() says it
inline constexpr double kVisualOverlap = 5e-3;                                // m: that is none
inline constexpr double kMaxUnseen = 0.05;                                    // of the samples

struct NamedConfiguration {
  std::string name;  // "the start pose"
  Eigen::VectorXd q;
};

struct VisualOverlap {
  std::pair<int, int> links;  // a < b
  std::string name;           // of the named configuration; empty: there is only a sample
  Eigen::VectorXd q;          // the first one
  std::size_t samples = 0;    // in which they overlap, until it is frequent
  bool is_frequent = false;   // in more than kMaxUnseen of them
};

// Looks at the named configurations and at samples, in their order. `collisions`: the robot's scene; pairs
// that it allows to touch are excluded, and so are those whose visual shapes overlap in nearly all samples,
// by design. Nothing is looked at where all collision shapes are the visual ones. Adds a note where visual
// meshes cannot be compared by their triangles.
[[nodiscard]] std::vector<VisualOverlap> find_visual_overlaps(const CheckContext& context,
                                                              const CollisionScene& collisions,
                                                              const std::vector<NamedConfiguration>& named,
                                                              const std::vector<Eigen::VectorXd>& samples,
                                                              std::vector<std::string>& notes);

}  // namespace doppel
