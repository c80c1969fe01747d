// W1: files that are made of each feature of poses and frames alone and in pairs. The poses in the world are chosen first
// and written relative to random frames, so that the reader has to come back to them.
#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <random>

#include "doppel/base/core/read_file.h"
#include "doppel/scenario/sdf/test/sdf_fixture.h"
#include "doppel/scenario/sdf/test/sdf_generator.h"

namespace doppel {
namespace {

constexpr double kSame = 1e-9;
constexpr int kFilesPerCombination = 10;

void expect_poses(const GeneratedWorld& made, const ReadSdf& read) {
  for (const auto& [model, link, X_WL] : made.links) {
    const SdfModel* const found = read.world.find(model);
    ASSERT_NE(found, nullptr) << model << "\n" << made.text;
    ASSERT_NE(found->description->find_link(link), nullptr) << link << "\n" << made.text;
    const Pose X = link_pose(*found, link);
    EXPECT_LT((X.matrix() - X_WL.matrix()).cwiseAbs().maxCoeff(), kSame) << model << " " << link << "\n"
                                                                         << made.text;
  }
  for (const auto& [model, joint, p_W, a_W] : made.axes) {
    const RobotDescription& robot = *read.model(model).description;
    const Joint* const found = robot.find_joint(joint);
    ASSERT_NE(found, nullptr) << joint;
    const Pose X_WJ = link_pose(read.model(model), found->parent) * found->origin.pose();
    const Eigen::Vector3d axis = X_WJ.linear() * found->axis.normalized();
    EXPECT_LT((axis - a_W).norm(), kSame) << joint << "\n" << made.text;
    EXPECT_LT((X_WJ.translation() - p_W).cross(a_W).norm(), kSame) << joint << "\n" << made.text;
  }
}

TEST(SdfPoses, EachFeatureAloneAndInPairsGivesTruePoses) {
  int files = 0;
  for (int a = 0; a < kPoseFeatures; ++a) {
    for (int b = a; b < kPoseFeatures; ++b) {
      for (int seed = 0; seed < kFilesPerCombination; ++seed) {
        const unsigned features = (1u << a) | (1u << b);
        const GeneratedWorld made =
            SdfGenerator(features, static_cast<unsigned>(1000 * (8 * a + b) + seed)).world();
        ReadSdf read;
        try {
          read = read_sdf(made.text);
        } catch (const InputError& refused) {
          FAIL() << refused.what() << made.text;
        }
        expect_poses(made, read);
        if (HasFailure()) return;
        ++files;
      }
    }
  }
  EXPECT_GE(files, 500);
}

TEST(SdfPoses, AllFeaturesTogetherGiveTruePoses) {
  for (unsigned seed = 0; seed < 100; ++seed) {
    const GeneratedWorld made = SdfGenerator((1u << kPoseFeatures) - 1, seed).world();
    expect_poses(made, read_sdf(made.text));
    if (HasFailure()) return;
  }
}

// Of the fuzz target's corpus, and generated ones.
std::vector<std::string> texts() {
  std::vector<std::string> out;
  const std::filesystem::path corpus = DOPPEL_SOURCE_DIR "/src/doppel/scenario/sdf/fuzz/corpus/sdf";
  for (const auto& entry : std::filesystem::directory_iterator(corpus))
    out.push_back(read_file(entry.path().string(), std::size_t{1} << 20));
  std::sort(out.begin(), out.end());
  EXPECT_GE(out.size(), 4u);
  for (unsigned seed = 0; seed < 60; ++seed)
    out.push_back(SdfGenerator(seed * 37 % (1u << kPoseFeatures), seed).world().text);
  return out;
}

// W2: no damaged text is anything but accepted or refused.
TEST(SdfPoses, DamagedTextIsReadOrRefused) {
  std::mt19937 random(7);
  int refused = 0, accepted = 0;
  for (const std::string& text : texts()) {
    for (int change = 0; change < 25; ++change) {
      std::string damaged = text;
      for (int i = 0; i <= change % 2; ++i) {
        const std::size_t at = random() % damaged.size(), length = random() % 12;
        const std::size_t from = random() % text.size();
        switch (random() % 3) {
          case 0:
            damaged.erase(at, length);
            break;
          case 1:
            damaged.insert(at, text.substr(from, length));
            break;
          default:
            damaged[at] = static_cast<char>(random() % 256);
        }
      }
      try {
        read_sdf(damaged);
        ++accepted;
      } catch (const InputError& error) {
        ++refused;
        EXPECT_FALSE(error.diagnostics().empty());
      }
    }
  }
  EXPECT_GT(refused, 100);
  EXPECT_GT(accepted, 100);
}

}  // namespace
}  // namespace doppel
