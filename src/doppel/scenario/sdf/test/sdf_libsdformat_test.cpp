// W1: poses of generated worlds against a second parser, libsdformat, which only this test uses.
#include <sdf/Frame.hh>
#include <sdf/Link.hh>
#include <sdf/Model.hh>
#include <sdf/Root.hh>
#include <sdf/World.hh>

#include "doppel/scenario/sdf/test/sdf_fixture.h"
#include "doppel/scenario/sdf/test/sdf_generator.h"

namespace doppel {
namespace {

constexpr double kSamePose = 1e-9;

Pose pose_of(const ignition::math::Pose3d& X) {
  Pose out = Pose::Identity();
  out.translation() = Eigen::Vector3d(X.Pos().X(), X.Pos().Y(), X.Pos().Z());
  out.linear() = Eigen::Quaterniond(X.Rot().W(), X.Rot().X(), X.Rot().Y(), X.Rot().Z()).toRotationMatrix();
  return out;
}

// A model's or link's pose in the frame of what contains it.
template <class Part>
Pose resolved(const Part& part, const std::string& in) {
  ignition::math::Pose3d X;
  const ::sdf::Errors errors = part.SemanticPose().Resolve(X, in);
  for (const ::sdf::Error& error : errors) ADD_FAILURE() << error.Message();
  return pose_of(X);
}

TEST(SdfPoses, GeneratedWorldsAgreeWithLibsdformat) {
  int links = 0;
  for (unsigned seed = 0; seed < 24; ++seed) {
    const unsigned features =
        seed < 16 ? (seed * 2654435761u) % (1u << kPoseFeatures) : (1u << kPoseFeatures) - 1;
    const GeneratedWorld made = SdfGenerator(features, 5000 + seed).world();
    const ReadSdf read = read_sdf(made.text);
    ::sdf::Root root;
    for (const ::sdf::Error& error : root.LoadSdfString(made.text))
      ADD_FAILURE() << error.Message() << made.text;
    const ::sdf::World* const world = root.WorldByIndex(0);
    ASSERT_NE(world, nullptr);
    for (const auto& [name, link, X_WL] : made.links) {
      const ::sdf::Model* const model = world->ModelByName(name);
      ASSERT_NE(model, nullptr);
      const ::sdf::Link* const found = model->LinkByName(link);
      ASSERT_NE(found, nullptr) << link;
      Pose X = resolved(*model, "world");
      for (std::size_t at = link.find("::"); at != std::string::npos; at = link.find("::", at + 2))
        X = X * resolved(*model->ModelByName(link.substr(0, at)), "__model__");
      X = X * resolved(*found, "__model__");
      EXPECT_LT((link_pose(read.model(name), link).matrix() - X.matrix()).cwiseAbs().maxCoeff(), kSamePose)
          << name << " " << link << "\n"
          << made.text;
      if (HasFailure()) return;
      ++links;
    }
  }
  EXPECT_GT(links, 200);
}

}  // namespace
}  // namespace doppel
