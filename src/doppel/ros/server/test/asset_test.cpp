#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>

#include <atomic>
#include <chrono>
#include <fstream>
#include <future>
#include <memory>
#include <thread>

#include "doppel/base/core/test/system_faults.h"
#include "doppel/ros/server/asset_library.h"
#include "doppel/ros/server/asset_reader.h"

namespace doppel {
namespace {

namespace fs = std::filesystem;
using std::string_literals::operator""s;
using ::testing::HasSubstr;

class AssetTest : public ::testing::Test {
 protected:
  AssetTest() {
    char name[] = "/tmp/doppel_asset_XXXXXX";
    folder_ = mkdtemp(name);
    package("arm");
    write("arm/meshes/a.stl", "mesh a");
    write("arm/meshes/b c.stl", "mesh b");
    write("arm/meshes/50%20.stl", "odd name");
    write("arm/meshes/tex.png", "picture");
    write("arm/materials/m.mtl", "material");
    write("arm/config/secret.yaml", "secret");
    write("outside.stl", "outside");
    write("outside.png", "outside");
  }
  ~AssetTest() override { fs::remove_all(folder_); }

  void write(const fs::path& file, const std::string& text) const {
    fs::create_directories((folder_ / file).parent_path());
    std::ofstream(folder_ / file) << text;
  }
  void package(const std::string& name, const fs::path& at = {}) const {
    const fs::path folder = at.empty() ? fs::path(name) : at;
    write(folder / "package.xml", "<package><name>" + name + "</name></package>");
  }
  // A description that refers to these meshes, each with the file it resolves to.
  void offer(const std::vector<std::pair<std::string, fs::path>>& meshes,
             const fs::path& description = "arm/urdf/arm.urdf") {
    RobotFiles files;
    files.description = folder_ / description;
    for (const auto& [uri, file] : meshes) files.meshes.push_back({uri, folder_ / file});
    library_.offer(files);
  }
  std::string get(const std::string& uri) {
    const auto answer = library_.read(uri);
    if (answer.bytes == nullptr) return "refused: " + answer.why;
    return {reinterpret_cast<const char*>(answer.bytes->data()), answer.bytes->size()};
  }

  fs::path folder_;
  AssetLibrary library_;
};

TEST_F(AssetTest, NamedFilesAreServed) {
  offer({{"package://arm/meshes/a.stl", "arm/meshes/a.stl"},
         {"package://arm/meshes/b c.stl", "arm/meshes/b c.stl"},
         {"package://arm/meshes/50%20.stl", "arm/meshes/50%20.stl"},
         {"../meshes/a.stl", "arm/meshes/a.stl"},
         {"file://" + (folder_ / "arm/meshes/a.stl").string(), "arm/meshes/a.stl"}});
  EXPECT_EQ(get("package://arm/meshes/a.stl"), "mesh a");
  EXPECT_EQ(get("package://arm/meshes/b c.stl"), "mesh b");
  EXPECT_EQ(get("package://arm/meshes/b%20c.stl"), "mesh b");
  EXPECT_EQ(get("package://arm/meshes/50%20.stl"), "odd name");
  EXPECT_EQ(get("../meshes/a.stl"), "mesh a");
  EXPECT_EQ(get("file://" + (folder_ / "arm/meshes/a.stl").string()), "mesh a");
  EXPECT_THAT(get("package://arm/meshes/A.stl"), HasSubstr("did you mean"));
}

TEST_F(AssetTest, TexturesAndMaterialsOfPackageAreServed) {
  offer({{"package://arm/meshes/a.stl", "arm/meshes/a.stl"}});
  EXPECT_EQ(get("package://arm/meshes/tex.png"), "picture");
  EXPECT_EQ(get("package://arm/meshes/../materials/m.mtl"), "material");
  EXPECT_EQ(get("package://arm/materials/%6d.mtl"), "material");
  EXPECT_EQ(get("file://" + (folder_ / "arm/meshes/tex.png").string()), "picture");
  for (const std::string& uri :
       {"package://arm/config/secret.yaml"s, "package://arm/package.xml"s, "package://arm/"s,
        "package://arm"s, "package://other/meshes/tex.png"s, "meshes/tex.png"s,
        (folder_ / "arm/meshes/tex.png").string(), "http://example.org/tex.png"s, ""s}) {
    EXPECT_THAT(get(uri), HasSubstr("refused: ")) << uri;
  }
}

TEST_F(AssetTest, MeshesOfSpawnedObjectsAreServed) {
  package("other");
  write("other/meshes/part.stl", "of a package that the robot needs nothing of");
  for (const char* ending : {"stl", "obj", "dae", "glb", "gltf", "STL"})
    write(std::string("arm/objects/part.") + ending, ending);
  write("arm/objects/part.bin", "not beside a glTF that is offered");
  write("arm/objects/part.py", "program");
  offer({});
  for (const char* ending : {"stl", "obj", "dae", "glb", "gltf", "STL"}) {
    EXPECT_EQ(get(std::string("package://arm/objects/part.") + ending), ending)
        << "expected the mesh of an object to be served though the robot has no mesh";
    EXPECT_EQ(get("file://" + (folder_ / "arm/objects/part.").string() + ending), ending);
  }
  EXPECT_EQ(get("model://arm/objects/part.stl"), "stl");
  offer({{"package://arm/meshes/a.stl", "arm/meshes/a.stl"}, {"../meshes/a.stl", "arm/meshes/a.stl"}});
  EXPECT_EQ(get("package://arm/objects/part.stl"), "stl");
  EXPECT_EQ(get("../objects/part.stl"), "stl");
  for (const std::string& uri : {"package://arm/objects/part.bin"s, "package://arm/objects/part.py"s,
                                 "package://arm/objects/none.stl"s, "package://other/meshes/part.stl"s,
                                 "file://" + (folder_ / "other/meshes/part.stl").string(),
                                 "package://arm/../other/meshes/part.stl"s, "../../other/meshes/part.stl"s,
                                 "../../outside.stl"s, "file://" + (folder_ / "outside.stl").string()}) {
    EXPECT_THAT(get(uri), HasSubstr("refused: ")) << uri;
  }
}

TEST_F(AssetTest, RefusalDoesNotRevealExistence) {
  offer({{"package://arm/meshes/a.stl", "arm/meshes/a.stl"}});
  const std::string there = get("package://arm/../outside.png"),
                    not_there = get("package://arm/../outsidf.png");
  EXPECT_THAT(there, HasSubstr("refused: "));
  EXPECT_EQ(there.substr(there.rfind(':')), not_there.substr(not_there.rfind(':')));
}

TEST_F(AssetTest, SymlinkIsResolvedBeforeCheck) {
  fs::create_symlink(folder_ / "arm/config/secret.yaml", folder_ / "arm/meshes/secret.png");
  fs::create_symlink(folder_ / "arm/meshes/tex.png", folder_ / "arm/meshes/same.png");
  offer({{"package://arm/meshes/a.stl", "arm/meshes/a.stl"}});
  EXPECT_THAT(get("package://arm/meshes/secret.png"), HasSubstr("a symbolic link to a file that is not"));
  EXPECT_EQ(get("package://arm/meshes/same.png"), "picture");
}

TEST_F(AssetTest, GltfBuffersAreServed) {
  write("arm/meshes/a.gltf", "gltf");
  write("arm/meshes/a.bin", "buffer");
  write("arm/config/a.bin", "something else");
  offer({{"package://arm/meshes/a.stl", "arm/meshes/a.stl"}});
  EXPECT_THAT(get("package://arm/meshes/a.bin"), HasSubstr("refused: "));
  offer({{"package://arm/meshes/a.gltf", "arm/meshes/a.gltf"}});
  EXPECT_EQ(get("package://arm/meshes/a.bin"), "buffer");
  EXPECT_THAT(get("package://arm/config/a.bin"), HasSubstr("refused: "));
}

TEST_F(AssetTest, WorldFilesAreServed) {
  write("place/worlds/table.yaml", "");
  write("place/meshes/table.stl", "table");
  write("place/notes.txt", "notes");
  const std::string uri = "file://" + (folder_ / "place/meshes/table.stl").string();
  RobotFiles files;
  files.description = folder_ / "arm/urdf/arm.urdf";
  files.meshes = {{uri, folder_ / "place/meshes/table.stl"}};
  library_.offer(files);
  EXPECT_THAT(get(uri), HasSubstr("outside its package"))
      << "expected a rejection: the file that refers to it is the description";
  files.meshes.front().named_in = folder_ / "place/worlds/table.yaml";
  library_.offer(files);
  EXPECT_EQ(get(uri), "table");
  EXPECT_THAT(get("file://" + (folder_ / "place/notes.txt").string()), HasSubstr("refused: "));
  EXPECT_THAT(get("file://" + (folder_ / "outside.stl").string()), HasSubstr("refused: "));
}

TEST_F(AssetTest, ImagesOfGazeboModelAreServed) {
  write("place/worlds/room.sdf", "<sdf/>");
  write("models/suv/meshes/suv.dae", "suv");
  write("models/suv/materials/textures/suv.png", "paint");
  write("models/other/secret.png", "secret");
  RobotFiles files;
  files.meshes = {{"model://suv/meshes/suv.dae", folder_ / "models/suv/meshes/suv.dae",
                   folder_ / "place/worlds/room.sdf", folder_ / "models/suv"}};
  library_.offer(files);
  EXPECT_EQ(get("model://suv/meshes/suv.dae"), "suv");
  EXPECT_EQ(get("model://suv/materials/textures/suv.png"), "paint");
  EXPECT_THAT(get("model://suv/../other/secret.png"), HasSubstr("refused: "));
  EXPECT_THAT(get("file://" + (folder_ / "models/other/secret.png").string()), HasSubstr("refused: "));
}

TEST_F(AssetTest, ParentPathIsRefused) {
  offer({{"package://arm/meshes/a.stl", "arm/meshes/a.stl"},
         {"package://arm/../outside.stl", "outside.stl"},
         {"../../outside.stl", "outside.stl"},
         {"file://" + (folder_ / "outside.stl").string(), "outside.stl"}});
  for (const std::string& uri :
       {"package://arm/../outside.stl"s, "../../outside.stl"s, "package://arm/../outside.png"s,
        "package://arm/meshes/../../outside.png"s, "package://arm/%2e%2e/outside.png"s,
        "package://arm/..%2foutside.png"s, "package://arm/%252e%252e/outside.png"s,
        "package://arm//" + (folder_ / "outside.png").string(), "package://arm/x/../../outside.png"s,
        "file://" + (folder_ / "outside.stl").string(), "file://" + (folder_ / "outside.png").string(),
        "package://arm/../outside.png\0.png"s, "package://arm/meshes/a.stl\0"s,
        "package://arm/../outside.png%00.png"s, "package://arm/" + std::string(5000, 'a') + ".png"}) {
    EXPECT_THAT(get(uri), HasSubstr("refused: ")) << uri;
  }
}

TEST_F(AssetTest, SymlinkOutOfPackageIsRefused) {
  fs::create_symlink(folder_ / "outside.stl", folder_ / "arm/meshes/link.stl");
  fs::create_symlink(folder_ / "outside.png", folder_ / "arm/meshes/link.png");
  fs::create_directory_symlink(folder_, folder_ / "arm/up");
  fs::create_symlink(folder_ / "arm/meshes/a.stl", folder_ / "arm/meshes/inside.stl");
  package("other");
  write("other/b.stl", "of another package");
  fs::create_symlink(folder_ / "other/b.stl", folder_ / "arm/meshes/other.stl");
  offer({{"package://arm/meshes/link.stl", "arm/meshes/link.stl"},
         {"package://arm/up/outside.stl", "arm/up/outside.stl"},
         {"package://arm/meshes/other.stl", "arm/meshes/other.stl"},
         {"package://arm/meshes/inside.stl", "arm/meshes/inside.stl"}});
  EXPECT_EQ(get("package://arm/meshes/inside.stl"), "mesh a");
  for (const char* uri :
       {"package://arm/meshes/link.stl", "package://arm/up/outside.stl", "package://arm/meshes/other.stl",
        "package://arm/meshes/link.png", "package://arm/up/outside.png"}) {
    EXPECT_THAT(get(uri), HasSubstr("outside its package")) << uri;
  }
}

TEST_F(AssetTest, SymlinkInstalledPackageIsServed) {
  package("arm", "install/share/arm");
  fs::create_directory_symlink(folder_ / "arm/meshes", folder_ / "install/share/arm/meshes");
  offer({{"package://arm/meshes/a.stl", "install/share/arm/meshes/a.stl"}}, "install/share/arm/arm.urdf");
  EXPECT_EQ(get("package://arm/meshes/a.stl"), "mesh a");
  offer({{"package://arm/meshes/a.stl", "arm/meshes/a.stl"}}, "install/share/arm/arm.urdf");
  EXPECT_EQ(get("package://arm/meshes/a.stl"), "mesh a")
      << "expected the mesh to be found by the file that the link points to";
}

TEST_F(AssetTest, WithoutPackageDescriptionFolderIsServed) {
  write("plain/urdf/arm.urdf", "");
  write("plain/meshes/a.stl", "plain mesh");
  offer({{"../meshes/a.stl", "plain/meshes/a.stl"}, {"../../outside.stl", "outside.stl"}},
        "plain/urdf/arm.urdf");
  EXPECT_EQ(get("../meshes/a.stl"), "plain mesh");
  EXPECT_THAT(get("../../outside.stl"), HasSubstr("refused: "));
}

// For example a description in a user's home folder.
TEST_F(AssetTest, WithoutPackageMeshCompanionsAreServed) {
  write("home/arm.urdf", "");
  write("home/meshes/a.dae", "mesh");
  write("home/meshes/skin/a.png", "skin");
  write("home/textures/a.png", "texture");
  write("home/Pictures/a.png", "private");
  write("home/part.stl", "private");
  offer({{"meshes/a.dae", "home/meshes/a.dae"}, {"../outside.stl", "outside.stl"}}, "home/arm.urdf");
  EXPECT_EQ(get("meshes/a.dae"), "mesh");
  EXPECT_EQ(get("meshes/skin/a.png"), "skin");
  EXPECT_EQ(get("meshes/../textures/a.png"), "texture");
  for (const std::string& uri : {"Pictures/a.png"s, "meshes/../Pictures/a.png"s, "part.stl"s,
                                 "../outside.png"s, "file://" + (folder_ / "home/Pictures/a.png").string()}) {
    EXPECT_THAT(get(uri), HasSubstr("refused: ")) << uri;
  }
  write("flat/arm.urdf", "");
  write("flat/a.dae", "mesh");
  write("flat/a.png", "skin");
  write("flat/Pictures/a.png", "private");
  offer({{"a.dae", "flat/a.dae"}}, "flat/arm.urdf");
  EXPECT_EQ(get("a.png"), "skin");
  EXPECT_THAT(get("Pictures/a.png"), HasSubstr("refused: "));
}

TEST_F(AssetTest, IrregularAndHugeFilesAreRefused) {
  ASSERT_EQ(mkfifo((folder_ / "arm/meshes/pipe.stl").c_str(), 0600), 0);
  write("arm/meshes/huge.stl", "");
  fs::resize_file(folder_ / "arm/meshes/huge.stl", AssetLibrary::kMaxBytes + 1);
  write("arm/meshes/most.stl", "");
  fs::resize_file(folder_ / "arm/meshes/most.stl", AssetLibrary::kMaxBytes);
  offer({{"package://arm/meshes/pipe.stl", "arm/meshes/pipe.stl"},
         {"package://arm/meshes/huge.stl", "arm/meshes/huge.stl"},
         {"package://arm/meshes/most.stl", "arm/meshes/most.stl"},
         {"package://arm/meshes", "arm/meshes"},
         {"package://arm/meshes/gone.stl", "arm/meshes/gone.stl"}});
  EXPECT_THAT(get("package://arm/meshes/pipe.stl"), HasSubstr("not a regular file"));
  EXPECT_THAT(get("package://arm/meshes/huge.stl"), HasSubstr("the maximum is 64 MiB"));
  EXPECT_EQ(library_.read("package://arm/meshes/most.stl").bytes->size(), AssetLibrary::kMaxBytes);
  EXPECT_THAT(get("package://arm/meshes"), HasSubstr("not a regular file"));
  EXPECT_THAT(get("package://arm/meshes/gone.stl"), HasSubstr("No such file"));
}

TEST_F(AssetTest, HeldBytesAreSharedUntilFileChanges) {
  offer({{"package://arm/meshes/a.stl", "arm/meshes/a.stl"}});
  const auto first = library_.read("package://arm/meshes/a.stl").bytes;
  EXPECT_EQ(library_.read("package://arm/meshes/a.stl").bytes, first);
  write("arm/meshes/a.stl", "edited");
  EXPECT_EQ(get("package://arm/meshes/a.stl"), "edited");
  offer({}, "arm.urdf");
  EXPECT_THAT(get("package://arm/meshes/a.stl"), HasSubstr("refused: "))
      << "expected a rejection after a reload that removes the mesh";
}

TEST(AssetReaderTest, FetchWithoutThreadGetsReason) {
  AssetReader reader(std::make_shared<AssetLibrary>());
  std::string why;
  const auto keep = [&why](const AssetLibrary::Answer& answer) { why = answer.why; };
  {
    const ThreadShortage shortage(0);
    reader.fetch("package://arm/meshes/a.stl", keep);
  }
  EXPECT_THAT(why, HasSubstr("no thread can be started to read files"));
}

TEST(AssetReaderTest, ReaderIsStartedByNextFetchAfterShortage) {
  AssetReader reader(std::make_shared<AssetLibrary>());
  {
    const ThreadShortage shortage(0);
    reader.fetch("package://arm/meshes/a.stl", [](const AssetLibrary::Answer&) {});
  }
  std::promise<std::string> why;
  reader.fetch("package://arm/meshes/a.stl",
               [&why](const AssetLibrary::Answer& answer) { why.set_value(answer.why); });
  std::future<std::string> answer = why.get_future();
  ASSERT_EQ(answer.wait_for(std::chrono::seconds(10)), std::future_status::ready);
  EXPECT_THAT(answer.get(), testing::Not(HasSubstr("no thread")));
}

// One request is under way when the reader ends, and half a second of work waits behind it.
TEST(AssetReaderTest, EndWaitsForRequestUnderWayAndDropsOthers) {
  constexpr int kOthers = 500;
  std::promise<void> begun, ending;
  const std::shared_future<void> may_go_on = ending.get_future().share();
  std::atomic<bool> first = false;
  std::atomic<int> others = 0;
  const auto held = std::make_shared<int>(0);
  auto reader = std::make_unique<AssetReader>(std::make_shared<AssetLibrary>());
  reader->fetch("package://arm/none.stl", [&, held](const AssetLibrary::Answer&) {
    begun.set_value();
    may_go_on.wait();
    first = true;
  });
  for (int i = 0; i < kOthers; ++i) {
    reader->fetch("package://arm/none.stl", [&others, held](const AssetLibrary::Answer&) {
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
      ++others;
    });
  }
  ASSERT_EQ(begun.get_future().wait_for(std::chrono::seconds(10)), std::future_status::ready);
  ending.set_value();
  reader.reset();
  EXPECT_TRUE(first.load());
  EXPECT_LT(others.load(), kOthers);
  EXPECT_EQ(held.use_count(), 1) << "expected no request to be left";
}

}  // namespace
}  // namespace doppel
