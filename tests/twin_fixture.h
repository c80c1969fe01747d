#pragma once
// A twin of a bundled robot for tests: built, stepped, and called through an edge.

#include <gtest/gtest.h>

#include <filesystem>
#include <memory>
#include <string>

#include "doppel/twin/assembly/twin.h"
#include "doppel/twin/loop/time_control.h"

namespace doppel::test {

class TwinFixture : public ::testing::Test {
 protected:
  void bring_up(Scenario scenario) {
    scenario.bundled_robots = DOPPEL_SOURCE_DIR "/robots";
    edge_.reset();
    twin_.reset();
    diagnostics_ = {};
    twin_ = std::make_unique<Twin>(scenario, log_, diagnostics_);
    edge_ = twin_->bus().attach("test");
  }
  void bring_up(const std::string& target) {
    Scenario scenario;
    scenario.robots = {{.target = target}};
    bring_up(scenario);
  }

  // An empty folder of the test that runs.
  static std::filesystem::path make_folder(const std::string& of) {
    const auto* info = ::testing::UnitTest::GetInstance()->current_test_info();
    std::filesystem::path out = std::filesystem::path(::testing::TempDir()) / of / info->name();
    std::filesystem::remove_all(out);
    std::filesystem::create_directories(out);
    return out;
  }
  // Adds a ball of 1 kg to the engine; `at` in the world, m.
  void spawn_ball(const std::string& name, const Eigen::Vector3d& at, double radius = 0.05) {
    WorldObject ball;
    ball.name = name;
    ball.shape = Sphere{radius};
    ball.X_WO.translation() = at;
    ball.mass = 1;
    CollisionMeshes meshes;
    twin_->engine().spawn(make_instance(ball, meshes, diagnostics_));
  }

  void run(double seconds) {
    const Time end = twin_->now() + from_seconds(seconds);
    while (twin_->now() < end) {
      ASSERT_FALSE(twin_->diverged()) << "at t = " << to_seconds(twin_->now()) << " s";
      twin_->between_steps();
      twin_->step();
    }
  }

  void publish(const std::string& topic, const std::string& type, const std::string& yaml) {
    const TypeSupport* support = find_type(type);
    ASSERT_NE(support, nullptr) << type;
    Bytes cdr;
    const Status converted = support->yaml_to_cdr(yaml, cdr);
    ASSERT_TRUE(converted.ok()) << converted.why();
    const Status sent = edge_->publish("/test", topic, type, cdr);
    ASSERT_TRUE(sent.ok()) << sent.why();
  }

  // Calls a service and runs the loop until it answers; returns the response as YAML.
  std::string call(const std::string& service, const std::string& type, const std::string& yaml) {
    const ServiceSupport* support = find_service(type);
    if (support == nullptr) return "no such type";
    Bytes request;
    if (const Status converted = support->request->yaml_to_cdr(yaml, request); !converted)
      return converted.why();
    std::string out = "no answer";
    edge_->call(service, request, [&](Status status, Bytes response) {
      if (!status) {
        out = status.why();
      } else if (const Status converted = support->response->cdr_to_yaml(response, out); !converted) {
        out = converted.why();
      }
    });
    twin_->between_steps();
    return out;
  }

  void listen(const std::string& name) {
    for (const TopicInfo& topic : twin_->bus().topics()) {
      if (topic.name == name) edge_->subscribe(topic.id);
    }
    twin_->between_steps();
  }
  // The messages of this type received since the last call; messages of other topics are discarded.
  template <class M>
  std::vector<M> received(const std::string& name) {
    TopicId id = 0;
    for (const TopicInfo& topic : twin_->bus().topics()) {
      if (topic.name == name) id = topic.id;
    }
    std::vector<M> out;
    Edge::Incoming incoming;
    while (edge_->next(incoming)) {
      if (incoming.topic != id) continue;
      const Status read = from_cdr(incoming.cdr, out.emplace_back());
      EXPECT_TRUE(read.ok()) << read.why();
    }
    return out;
  }

  [[nodiscard]] JointSnapshot joint(const std::string& name) const {
    for (JointSnapshot& snapshot : twin_->robot().joints()) {
      if (snapshot.name == name) return snapshot;
    }
    ADD_FAILURE() << "expected a joint " << name;
    return {};
  }

  Log log_;
  Diagnostics diagnostics_;
  std::unique_ptr<Twin> twin_;
  std::unique_ptr<Edge> edge_;
};

}  // namespace doppel::test
