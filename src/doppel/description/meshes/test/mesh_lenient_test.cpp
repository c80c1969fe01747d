// Files that doppel's own readers reject and that RViz and Gazebo show: what assimp reads is readable.
#include <gtest/gtest.h>
#include <sys/stat.h>

#include <filesystem>
#include <fstream>

#include "doppel/base/core/diagnostic.h"
#include "doppel/description/meshes/mesh.h"

namespace doppel {
namespace {

namespace fs = std::filesystem;

class MeshToleranceTest : public testing::Test {
 protected:
  MeshToleranceTest() {
    const auto* info = testing::UnitTest::GetInstance()->current_test_info();
    folder_ = fs::path(testing::TempDir()) / (std::string("doppel_lenient_") + info->name());
    fs::remove_all(folder_);
    fs::create_directories(folder_);
  }
  ~MeshToleranceTest() override { fs::remove_all(folder_); }

  std::string write(const std::string& name, const std::string& bytes) const {
    std::ofstream(folder_ / name, std::ios::binary) << bytes;
    return (folder_ / name).string();
  }
  TriangleMesh load(const std::string& name, const std::string& bytes) const {
    return load_mesh(write(name, bytes), Eigen::Vector3d::Ones());
  }
  std::string rule_of_refusal(const std::string& path) const {
    try {
      load_mesh(path, Eigen::Vector3d::Ones());
    } catch (const InputError& error) {
      return error.diagnostics().front().rule;
    }
    return "accepted";
  }

  fs::path folder_;
};

// A tetrahedron with edges of 100 mm, in a document of millimetres whose y axis points up.
std::string collada_tetrahedron() {
  return R"(<?xml version="1.0"?>
<COLLADA xmlns="http://www.collada.org/2005/11/COLLADASchema" version="1.4.1">
<asset><unit meter="0.001" name="millimeter"/><up_axis>Y_UP</up_axis></asset>
<library_geometries><geometry id="g"><mesh><source id="p"><float_array id="pa" count="12">
0 0 0 100 0 0 0 100 0 0 0 50</float_array><technique_common><accessor source="#pa" count="4" stride="3">
<param name="X" type="float"/><param name="Y" type="float"/><param name="Z" type="float"/></accessor>
</technique_common></source><vertices id="v"><input semantic="POSITION" source="#p"/></vertices>
<triangles count="4"><input semantic="VERTEX" source="#v" offset="0"/><p>0 2 1 0 1 3 0 3 2 1 2 3</p></triangles>
</mesh></geometry></library_geometries><library_visual_scenes><visual_scene id="s"><node id="n">
<instance_geometry url="#g"/></node></visual_scene></library_visual_scenes>
<scene><instance_visual_scene url="#s"/></scene></COLLADA>
)";
}

std::string with(std::string text, const std::string& from, const std::string& to) {
  return text.replace(text.find(from), from.size(), to);
}

TEST_F(MeshToleranceTest, MalformedColladaIsReadAsInRviz) {
  const TriangleMesh good = load("good.dae", collada_tetrahedron());
  EXPECT_TRUE(good.remark.empty());
  struct Case {
    const char* what;
    std::string text;
    bool own_reader;  // reads it without a diagnostic
  };
  const Case cases[] = {
      {"an attribute with '<'", with(collada_tetrahedron(), "id=\"n\"", "id=\"<STL_BINARY>\""), false},
      {"blank lines before <?xml", "\n\n" + collada_tetrahedron(), true},
      {"NULs at the end", collada_tetrahedron() + std::string(7, '\0'), false},
      {"a bare &", with(collada_tetrahedron(), "millimeter", "a & b"), false}};
  for (const auto& [what, text, own_reader] : cases) {
    SCOPED_TRACE(what);
    const TriangleMesh mesh = load("bad.dae", text);
    EXPECT_EQ(mesh.remark.empty(), own_reader);
    EXPECT_EQ(mesh.triangles.size(), good.triangles.size());
    // The unit is applied and the up axis is not, as in doppel's own reader.
    EXPECT_TRUE(mesh.bounds().min().isApprox(good.bounds().min(), 1e-6F) || good.bounds().min().isZero());
    EXPECT_TRUE(mesh.bounds().max().isApprox(good.bounds().max(), 1e-6F)) << mesh.bounds().max();
  }
  EXPECT_NEAR(good.bounds().max().z(), 0.05, 1e-7);
}

// assimp 5.2 reads it, and later versions refuse it: then the message of the first reader stays.
TEST_F(MeshToleranceTest, IndexBeyondArrayWithinAccessorIsReadOrRefused) {
  const std::string far =
      with(with(collada_tetrahedron(), "count=\"4\" stride", "count=\"5\" stride"), "1 2 3</p>", "1 2 4</p>");
  const std::string rule = rule_of_refusal(write("far.dae", far));
  if (rule == "accepted") {
    EXPECT_FALSE(load("far.dae", far).remark.empty());
  } else {
    EXPECT_EQ(rule, "mesh.unreadable");
  }
  EXPECT_EQ(rule_of_refusal(write("further.dae", with(collada_tetrahedron(), "1 2 3</p>", "1 2 9</p>"))),
            "mesh.unreadable");
}

TEST_F(MeshToleranceTest, ObjFacesBeforeVerticesAreRead) {
  EXPECT_EQ(load("a.obj", "f 1 2 3\nv 0 0 0\nv 1 0 0\nv 0 1 0\n").triangles.size(), 1u);
  EXPECT_EQ(load("b.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2\nf 1 2 3\n").triangles.size(), 1u);
}

TEST_F(MeshToleranceTest, FileRefusedByBothReadersKeepsOwnMessage) {
  const std::string path = write("c.obj", "v 0 0 0\nf 1 2 3\n");
  try {
    load_mesh(path, Eigen::Vector3d::Ones());
    FAIL() << "expected an InputError: no reader accepts the file";
  } catch (const InputError& error) {
    EXPECT_NE(error.diagnostics().front().message.find("vertex '2'"), std::string::npos);
    EXPECT_EQ(error.diagnostics().front().where.line, 2);
  }
}

TEST_F(MeshToleranceTest, UpperCaseExtensionIsSameFormat) {
  EXPECT_TRUE(load("A.OBJ", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n").remark.empty());
}

TEST_F(MeshToleranceTest, GitLfsPointerIsReported) {
  const std::string pointer = "version https://git-lfs.github.com/spec/v1\noid sha256:0a\nsize 12\n";
  for (const char* name : {"a.stl", "a.dae", "a.obj", "a.glb"})
    EXPECT_EQ(rule_of_refusal(write(name, pointer)), "mesh.not_fetched") << name;
}

TEST_F(MeshToleranceTest, PipesAndFoldersAreRefused) {
  for (const char* name : {"p.ply", "p.stl", "p.glb"}) {
    const std::string path = (folder_ / name).string();
    ASSERT_EQ(mkfifo(path.c_str(), 0600), 0);
    EXPECT_NE(rule_of_refusal(path), "accepted") << name;
  }
  EXPECT_NE(rule_of_refusal(folder_.string()), "accepted");
  EXPECT_NE(rule_of_refusal((folder_ / "none.ply").string()), "accepted");
}

// The files are sparse: they take no space on the disk.
TEST_F(MeshToleranceTest, FilesBeyondTheirBoundsAreRefused) {
  const auto problem = [this](const char* name, std::uintmax_t bytes) -> std::string {
    const std::string path = write(name, "");
    fs::resize_file(path, bytes);
    try {
      load_mesh(path, Eigen::Vector3d::Ones());
    } catch (const InputError& error) {
      return error.what();
    }
    return "accepted";
  };
  for (const char* name : {"huge.stl", "huge.obj", "huge.dae"})
    EXPECT_NE(problem(name, (std::uintmax_t{1} << 30) + 1).find("larger than"), std::string::npos) << name;
  const std::string by_assimp = problem("huge.glb", (std::uintmax_t{256} << 20) + 1);
  EXPECT_NE(by_assimp.find("larger than 256 MB"), std::string::npos) << by_assimp;
}

TEST_F(MeshToleranceTest, BinaryStlWithSolidHeaderAndTrailerIsRead) {
  std::string bytes = "solid of a part";
  bytes.resize(80, ' ');
  bytes += std::string("\x01\0\0\0", 4);
  const float corners[12] = {0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1, 0};
  bytes.append(reinterpret_cast<const char*>(corners), sizeof corners);
  bytes += std::string(2, '\0') + "more";
  EXPECT_EQ(load("s.stl", bytes).triangles.size(), 1u);
}

}  // namespace
}  // namespace doppel
