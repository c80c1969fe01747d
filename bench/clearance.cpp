// Covers, lanes and certified edges of robots among objects: the spheres of a cover and how far they stick
// out, the time to make it and to read it from the cache, the time of eight states against the world and the
// robot itself with every module of kernels, the time of states with their triangles, certified edges in a
// second, and how often FCL disagrees.
//
//   bench_clearance [--srdf FILE] [--spheres] [--dump FILE] [--objects N] [robot or file ...]
//
// --srdf: the pairs that it disables, in the place of those that touch at the start. --spheres: its
// link_sphere_approximation as they are, in the place of the covers, and only the lanes are measured. --dump:
// the objects and states as text, for the measurement of other programs. Without robots: the bundled ones.
#include "doppel/robot/clearance/clearance.h"

#include <fmt/format.h>

#include <cstdlib>
#include <ctime>
#include <fstream>
#include <string>
#include <vector>

#include "doppel/base/core/plugin_module.h"
#include "doppel/description/srdf/srdf.h"
#include "doppel/robot/clearance/test/clearance_robots.h"

namespace {

using namespace doppel;

constexpr std::uint64_t kSeed = 7;
constexpr int kStates = 4096, kJudged = 1000, kEdges = 300;

struct Options {
  std::string srdf, dump;
  bool spheres = false;
  int objects = 14;
  std::vector<std::string> robots;
};

double computed_us() {
  timespec now{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
  return static_cast<double>(now.tv_sec) * 1e6 + static_cast<double>(now.tv_nsec) * 1e-3;
}

template <class Work>
double measured_us(const Work& work) {
  const double begin = computed_us();
  work();
  return computed_us() - begin;
}

// The extent of the arm's links about its root, at the start.
double reach_of(const Model& model) {
  Data data(model);
  forward_kinematics(model, data, model.neutral());
  double reach = 0.2;
  for (const Pose& X : data.X_WL) reach = std::max(reach, X.translation().norm());
  return reach;
}

// Boxes, spheres and cylinders around the robot's root.
std::vector<SceneInstance> make_objects(double reach, int count) {
  std::mt19937_64 random(kSeed);
  const auto number = [&](double low, double high) {
    return std::uniform_real_distribution(low, high)(random);
  };
  std::vector<SceneInstance> out;
  for (int i = 0; i < count; ++i) {
    const double angle = number(-3.1, 3.1), away = reach * number(0.6, 1.1),
                 size = reach * number(0.05, 0.15);
    const Eigen::Vector3d at(away * std::cos(angle), away * std::sin(angle), reach * number(0.0, 1.0));
    const Geometry shapes[] = {Box{{size, 2 * size, size}}, Sphere{size}, Cylinder{size / 2, 2 * size}};
    out.push_back(test::placed_object(fmt::format("object_{}", i), shapes[i % 3], at));
  }
  return out;
}

class Bench {
 public:
  Bench(const std::string& target, const Options& options) : options_(options) {
    PackageResolver resolver;
    resolver.add_bundled(DOPPEL_ROBOTS);
    const Target found = resolve_target(target, DOPPEL_ROBOTS);
    resolver.add_context(found.description);
    Diagnostics diagnostics;
    robot_ = load_description(found.description, {}, resolver, diagnostics).robot;
    model_ = std::make_shared<const Model>(compile_model(robot_, BaseKind::fixed, diagnostics));
    instance_ = described_robot(robot_, *model_);
    if (!options.srdf.empty()) srdf_ = load_srdf(options.srdf, resolver, diagnostics);
    objects_ = make_objects(reach_of(*model_), options.objects);
    links_ = test::fcl_links(robot_, instance_);
  }

  void run() {
    fmt::print("\n{}: {} links, {} positions, {} objects\n", robot_.name, model_->links.size(), model_->nq,
               objects_.size());
    make_scene();
    if (options_.spheres) {
      covers_[0] = written_spheres();
    } else {
      report_covers();
    }
    std::mt19937_64 random(kSeed);
    states_.resize(model_->nq, kStates);
    for (int i = 0; i < kStates; ++i) states_.col(i) = test::random_state(*model_, random);
    dump();
    measure_lanes();
    if (options_.spheres) return;
    measure_states();
    measure_edges();
  }

 private:
  void make_scene() {
    SceneOptions scene;
    scene.detail = CollisionDetail::triangles;
    if (srdf_) {
      for (const SrdfLinkPair& pair : srdf_->disabled) {
        const int a = model_->find_link(pair.link1), b = model_->find_link(pair.link2);
        if (a >= 0 && b >= 0)
          scene.allowed.push_back({{0, std::min(a, b)}, {0, std::max(a, b)}, pair.reason});
      }
    } else {
      CollisionContext start(std::make_shared<const CollisionScene>(std::vector{instance_}, scene));
      for (const auto& [a, b] : start.scene().tested_pairs()) {
        if (start.surfaces_touch(a, b)) scene.allowed.push_back({a, b, "touching at the start"});
      }
    }
    std::vector instances{instance_};
    instances.insert(instances.end(), objects_.begin(), objects_.end());
    scene_ = std::make_shared<const CollisionScene>(std::move(instances), scene);
    CoverOptions still;
    still.still = true;
    covers_.push_back(nullptr);
    for (const SceneInstance& object : objects_) covers_.push_back(make_covers(object, still));
  }

  void report_covers() {
    CoverOptions fresh;
    fresh.cache = false;
    const double first = measured_us([&] { covers_[0] = make_covers(instance_, fresh); });
    static_cast<void>(make_covers(instance_));
    const double cached = measured_us([&] { covers_[0] = make_covers(instance_); });
    std::size_t shapes = 0;
    std::array<std::size_t, 3> spheres{};
    std::array<double, 3> excess{}, sum{};
    for (const auto& link : *covers_[0]) {
      for (const ShapeCover& shape : link) {
        ++shapes;
        for (std::size_t level = 0; level < 3; ++level) {
          spheres[level] += shape.cover.levels[level].size();
          excess[level] = std::max(excess[level], shape.cover.excess[level]);
          sum[level] += shape.cover.excess[level];
        }
      }
    }
    fmt::print("  covers of {} shapes: first {:.0f} ms, cached {:.1f} ms; spheres {} + {}\n", shapes,
               first * 1e-3, cached * 1e-3, spheres[1], spheres[2]);
    fmt::print("  they stick out by at most {:.1f} and {:.1f} mm, {:.1f} and {:.1f} mm in the mean\n",
               excess[1] * 1e3, excess[2] * 1e3, sum[1] * 1e3 / static_cast<double>(shapes),
               sum[2] * 1e3 / static_cast<double>(shapes));
  }

  // The spheres of an SRDF; both levels are the same.
  [[nodiscard]] std::shared_ptr<const InstanceCovers> written_spheres() const {
    auto out = std::make_shared<InstanceCovers>(model_->links.size());
    for (const SrdfSpheres& of_link : srdf_->spheres) {
      const int link = model_->find_link(of_link.link);
      if (link < 0) continue;
      for (const SrdfSphere& s : of_link.spheres) {
        ShapeCover shape;
        shape.cover.levels.fill({CoverSphere{s.center, s.radius}});
        (*out)[static_cast<std::size_t>(link)].push_back(std::move(shape));
      }
    }
    return out;
  }

  void dump() const {
    if (options_.dump.empty()) return;
    std::ofstream out(options_.dump);
    for (std::size_t i = 0; i < objects_.size(); ++i) {
      const auto& geometry = objects_[i].shapes[0][0].geometry;
      const Eigen::Vector3d p = objects_[i].X_WR.translation();
      if (const auto* box = std::get_if<Box>(&geometry))
        out << fmt::format("box {} {} {} {} {} {}\n", p.x(), p.y(), p.z(), box->size.x(), box->size.y(),
                           box->size.z());
      if (const auto* sphere = std::get_if<Sphere>(&geometry))
        out << fmt::format("sphere {} {} {} {}\n", p.x(), p.y(), p.z(), sphere->radius);
      if (const auto* c = std::get_if<Cylinder>(&geometry))
        out << fmt::format("cylinder {} {} {} {} {}\n", p.x(), p.y(), p.z(), c->radius, c->length);
    }
    for (Eigen::Index i = 0; i < states_.cols(); ++i) {
      out << "state";
      for (const double x : states_.col(i)) out << ' ' << x;
      out << '\n';
    }
  }

  // Eight states in a call: all random ones, and only those that the spheres of the level prove free, which
  // end no search early.
  void measure_lanes() {
    for (const std::string& module : modules_for_processor("doppel_lane_kernels")) {
      if (!plugin_module_exists(module)) continue;
      ClearanceOptions options;
      options.kernels = &lane_kernels(module.c_str());
      Clearance clearance(scene_, covers_, options);
      std::string line = fmt::format("  {:27}{} pairs", module + ":", clearance.pair_count());
      for (const int level : {1, 2}) {
        const Eigen::MatrixXd free = free_ones(clearance, level);
        line += fmt::format("; level {} ({} spheres), {:.1f} % free:", level, clearance.sphere_count(level),
                            100.0 * static_cast<double>(free.cols()) / kStates);
        for (const Eigen::Index lanes : {8, 16}) {
          line += fmt::format(" {:.2f} us", per_eight(clearance, states_, level, lanes));
          if (free.cols() >= 64)
            line += fmt::format(", free ones {:.2f} us", per_eight(clearance, free, level, lanes));
          if (lanes == 8) line += " | of sixteen:";
        }
      }
      fmt::print("{}\n", line);
    }
  }

  [[nodiscard]] Eigen::MatrixXd free_ones(Clearance& clearance, int level) const {
    Eigen::MatrixXd out(states_.rows(), states_.cols());
    Eigen::Index count = 0;
    for (Eigen::Index i = 0; i < states_.cols(); ++i) {
      if (clearance.touching_spheres(states_.col(i), level, true) == 0) out.col(count++) = states_.col(i);
    }
    return out.leftCols(count);
  }

  // us of eight states; the best of five rounds.
  static double per_eight(Clearance& clearance, const Eigen::MatrixXd& states, int level,
                          Eigen::Index lanes) {
    double best = 1e9;
    std::uint32_t used = 0;
    for (int round = 0; round < 5; ++round) {
      const double us = measured_us([&] {
        for (Eigen::Index i = 0; i + lanes <= states.cols(); i += lanes)
          used ^= clearance.touching_spheres(states.middleCols(i, lanes), level, true);
      });
      best = std::min(best, us * 8 / static_cast<double>(states.cols() / lanes * lanes));
    }
    return used == 0xFFFFFFFF ? 0 : best;
  }

  void measure_states() {
    Clearance clearance(scene_, covers_);
    CollisionContext context(scene_);
    Data data(*model_);
    int wrong_free = 0, wrong_touching = 0, free = 0, asked = 0, touching_here = 0;
    double ours = 0, theirs = 0;
    for (int i = 0; i < kJudged; ++i) {
      const Eigen::VectorXd q = states_.col(i);
      StateClearance found;
      ours += measured_us([&] { found = clearance.state(q); });
      theirs += measured_us([&] {
        context.set_configuration(0, q);
        const bool any = std::ranges::any_of(scene_->tested_pairs(), [&](const auto& pair) {
          return context.surfaces_touch(pair.first, pair.second);
        });
        touching_here += any ? 1 : 0;
      });
      forward_kinematics(*model_, data, q);
      const bool touching = std::ranges::any_of(
          scene_->tested_pairs(), [&](const auto& pair) { return judged_touching(pair, data.X_WL); });
      wrong_free += found.free && touching ? 1 : 0;
      wrong_touching += !found.free && !touching ? 1 : 0;
      free += found.free ? 1 : 0;
      asked += found.by_scene ? 1 : 0;
    }
    fmt::print(
        "  {} states: {} free, {} of all by triangles; {:.1f} us a state, all by triangles {:.1f} us\n",
        kJudged, free, asked, ours / kJudged, theirs / kJudged);
    fmt::print("  free here and touching by FCL: {}; the reverse: {}; touching by all triangles: {}\n",
               wrong_free, wrong_touching, touching_here);
  }

  // FCL judges by its own trees and primitives, which share nothing with the scene but the files.
  bool judged_touching(const std::pair<BodyId, BodyId>& pair, const std::vector<Pose>& X_WL) const {
    const auto place = [&](BodyId body) {
      return body.instance > 0 ? objects_[static_cast<std::size_t>(body.instance) - 1].X_WR
                               : X_WL[static_cast<std::size_t>(body.link)];
    };
    const auto parts = [&](BodyId body) {
      if (body.instance == 0) return links_[static_cast<std::size_t>(body.link)];
      const SceneInstance& object = objects_[static_cast<std::size_t>(body.instance) - 1];
      return test::FclParts{{test::fcl_geometry(object.shapes[0][0]), Pose::Identity()}};
    };
    return test::parts_touch(parts(pair.first), place(pair.first), parts(pair.second), place(pair.second));
  }

  void measure_edges() {
    Clearance clearance(scene_, covers_);
    std::vector<Eigen::VectorXd> free;
    for (int i = 0; i < kStates && static_cast<int>(free.size()) < 2 * kEdges; ++i) {
      if (clearance.is_free(states_.col(i))) free.push_back(states_.col(i));
    }
    for (const double part : {0.05, 0.3, 1.0}) {
      int edges = 0, certified = 0, by_resolution = 0;
      long states = 0, distances = 0;
      double us = 0, us_certified = 0;
      for (std::size_t i = 0; i + 1 < free.size(); i += 2) {
        const Eigen::VectorXd q0 = free[i], q1 = q0 + part * (free[i + 1] - q0);
        EdgeClearance found;
        const double time = measured_us([&] { found = clearance.edge(q0, q1, false); });
        us += time;
        ++edges;
        states += found.states;
        distances += found.measured;
        if (found.free) us_certified += time;
        certified += found.free ? 1 : 0;
        by_resolution += found.resolution ? 1 : 0;
      }
      if (edges == 0) continue;
      fmt::print(
          "  edges of {:3.0f} % of a random way: {:4} certified of {} ({} not for the resolution), {:.0f} a "
          "second; "
          "{:.0f} us each, certified ones {:.0f} us; {:.1f} states, {:.1f} distances\n",
          part * 100, certified, edges, by_resolution, edges / us * 1e6, us / edges,
          certified > 0 ? us_certified / certified : 0, static_cast<double>(states) / edges,
          static_cast<double>(distances) / edges);
    }
  }

  Options options_;
  RobotDescription robot_;
  std::shared_ptr<const Model> model_;
  SceneInstance instance_;
  std::optional<SrdfDescription> srdf_;
  std::vector<SceneInstance> objects_;
  std::shared_ptr<const CollisionScene> scene_;
  std::vector<std::shared_ptr<const InstanceCovers>> covers_;
  std::vector<std::vector<std::pair<test::FclGeometry, Pose>>> links_;
  Eigen::MatrixXd states_;
};

Options parse(int argc, char** argv) {
  Options out;
  for (int i = 1; i < argc; ++i) {
    const std::string word = argv[i];
    const bool more = i + 1 < argc;
    if (word == "--srdf" && more) {
      out.srdf = argv[++i];
    } else if (word == "--dump" && more) {
      out.dump = argv[++i];
    } else if (word == "--objects" && more) {
      out.objects = std::atoi(argv[++i]);
    } else if (word == "--spheres") {
      out.spheres = true;
    } else {
      out.robots.push_back(word);
    }
  }
  if (out.robots.empty()) out.robots = {"omarm_one", "omarm_zero", "lab_arm", "kate"};
  return out;
}

}  // namespace

int main(int argc, char** argv) {
  const Options options = parse(argc, argv);
  try {
    for (const std::string& robot : options.robots) Bench(robot, options).run();
  } catch (const std::exception& error) {
    fmt::print(stderr, "{}\n", error.what());
    return EXIT_FAILURE;
  }
  return EXIT_SUCCESS;
}
