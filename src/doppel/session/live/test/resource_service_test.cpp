#include "doppel/session/live/resource_service.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <thread>

#include "doppel/ros/messages/resource_retriever_interfaces.h"
#include "doppel/ros/messages/rviz_resource_interfaces.h"

namespace doppel {
namespace {

namespace fs = std::filesystem;
using testing::HasSubstr;

class ResourceServiceTest : public testing::TestWithParam<Distro> {
 protected:
  ResourceServiceTest() {
    set_ros_distro(GetParam());
    folder_ = fs::path(testing::TempDir()) / "doppel_resources" / std::string(to_string(GetParam())) / "arm";
    fs::create_directories(folder_ / "meshes");
    std::ofstream(folder_ / "package.xml") << "<package><name>arm</name></package>";
    std::ofstream(folder_ / "meshes/base.stl") << "solid base";
    std::ofstream(folder_ / "secret.txt") << "secret";
    assets_->offer({folder_ / "arm.urdf",
                    {{.uri = "package://arm/meshes/base.stl", .file = folder_ / "meshes/base.stl"}},
                    {}});
    service_.emplace(bus_, assets_);
    edge_ = bus_.attach("edge");
  }
  ~ResourceServiceTest() override {
    edge_.reset();
    service_.reset();
    fs::remove_all(folder_.parent_path());
    set_ros_distro(Distro::jazzy);
  }

  template <class Srv>
  typename Srv::Response get(const std::string& service, const std::string& path,
                             const std::string& etag = "") {
    typename Srv::Request request;
    request.path = path;
    request.etag = etag;
    typename Srv::Response response;
    bool done = false;
    edge_->call(service, to_cdr(request), [&](const Status& status, const Bytes& cdr) {
      EXPECT_TRUE(status) << status.why();
      EXPECT_TRUE(from_cdr(cdr, response));
      done = true;
    });
    for (int i = 0; i < 10000 && !done; ++i) {
      bus_.spin();
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
    }
    EXPECT_TRUE(done) << path;
    return response;
  }

  Bus bus_;
  fs::path folder_;
  std::shared_ptr<AssetLibrary> assets_ = std::make_shared<AssetLibrary>();
  std::optional<ResourceService> service_;
  std::unique_ptr<Edge> edge_;
};

template <class Response>
std::string text_of(const Response& response) {
  return {response.body.begin(), response.body.end()};
}

class ResourceServiceOfKilted : public ResourceServiceTest {};
INSTANTIATE_TEST_SUITE_P(Kilted, ResourceServiceOfKilted, testing::Values(Distro::kilted));

TEST_P(ResourceServiceOfKilted, AnswersWithBytesOnceAndThenNotModified) {
  using Srv = rviz_resource_interfaces::srv::GetResource;
  const auto first = get<Srv>("/rviz/get_resource", "package://arm/meshes/base.stl");
  EXPECT_EQ(first.status_code, Srv::Response::OK) << first.error_reason;
  EXPECT_EQ(text_of(first), "solid base");
  EXPECT_EQ(first.expanded_path, "package://arm/meshes/base.stl");
  const auto again = get<Srv>("/rviz/get_resource", "package://arm/meshes/base.stl", first.etag);
  EXPECT_EQ(again.status_code, Srv::Response::NOT_MODIFIED);
  EXPECT_TRUE(again.body.empty());
  EXPECT_EQ(again.etag, first.etag);
  std::ofstream(folder_ / "meshes/base.stl") << "solid changed";
  const auto changed = get<Srv>("/rviz/get_resource", "package://arm/meshes/base.stl", first.etag);
  EXPECT_EQ(text_of(changed), "solid changed");
}

TEST_P(ResourceServiceOfKilted, OtherFilesAreRefusedWithReason) {
  using Srv = rviz_resource_interfaces::srv::GetResource;
  for (const std::string& path : {std::string("package://arm/secret.txt"), std::string("file:///etc/passwd"),
                                  std::string("package://arm/../../etc/passwd"), std::string("")}) {
    const auto answer = get<Srv>("/rviz/get_resource", path);
    EXPECT_EQ(answer.status_code, Srv::Response::ERROR) << path;
    EXPECT_TRUE(answer.body.empty()) << path;
    EXPECT_THAT(answer.error_reason, HasSubstr("served")) << path;
  }
}

class ResourceServiceOfLyrical : public ResourceServiceTest {};
INSTANTIATE_TEST_SUITE_P(Lyrical, ResourceServiceOfLyrical, testing::Values(Distro::lyrical));

TEST_P(ResourceServiceOfLyrical, PathIsThatOfServiceUri) {
  using Srv = resource_retriever_interfaces::srv::GetResource;
  const auto answer = get<Srv>("/resource_provider", "arm/meshes/base.stl");
  EXPECT_EQ(answer.status_code, Srv::Response::OK) << answer.error_reason;
  EXPECT_EQ(text_of(answer), "solid base");
}

TEST_P(ResourceServiceOfLyrical, ServiceMayEndBeforeItsAnswers) {
  using Srv = resource_retriever_interfaces::srv::GetResource;
  Srv::Request request;
  request.path = "arm/meshes/base.stl";
  for (int i = 0; i < 50; ++i)
    edge_->call("/resource_provider", to_cdr(request), [](const Status&, const Bytes&) {});
  bus_.spin();
  service_.reset();
  bus_.spin();
}

class ResourceServiceOfJazzy : public ResourceServiceTest {};
INSTANTIATE_TEST_SUITE_P(Jazzy, ResourceServiceOfJazzy, testing::Values(Distro::jazzy));

TEST_P(ResourceServiceOfJazzy, HasNone) {
  EXPECT_TRUE(bus_.services().empty());
}

}  // namespace
}  // namespace doppel
