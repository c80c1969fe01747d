#include <gtest/gtest.h>

#include <fstream>
#include <map>

#include "doppel/ros/server/detail/http_responses.h"
#include "doppel/ros/server/detail/page_files.h"

namespace doppel {
namespace {

namespace fs = std::filesystem;

class PageTest : public ::testing::Test {
 protected:
  PageTest() {
    char name[] = "/tmp/doppel_page_XXXXXX";
    folder_ = mkdtemp(name);
  }
  ~PageTest() override { fs::remove_all(folder_); }
  void write(const fs::path& file, const std::string& text) const {
    fs::create_directories((folder_ / "dist" / file).parent_path());
    std::ofstream(folder_ / "dist" / file) << text;
  }
  void build() const {
    write("index.html", "<html>");
    write("assets/main-EPFJUWFJ.js", "script");
    write("assets/main-EPFJUWFJ.js.gz", "packed");
    write("assets/plain.css", "style");
    write("assets/secret.txt", "no kind of file that is served");
    write("secret.html", "not in assets");
  }
  HttpResponse get(const std::string& target, const std::string& accept = "", const std::string& known = "") {
    return http_response_to(
        {.method = "GET", .target = target, .accept_encoding = accept, .if_none_match = known}, page_,
        {.name = "arm", .url = "ws://127.0.0.1:8700"});
  }
  static std::string header(const HttpResponse& answer, const std::string& name) {
    for (const auto& [key, value] : answer.headers) {
      if (key == name) return value;
    }
    return "";
  }

  fs::path folder_;
  PageFiles page_{fs::path()};
};

TEST_F(PageTest, BuiltFilesAreServed) {
  page_ = PageFiles(folder_ / "dist");
  EXPECT_NE(get("/").content().find("is not built"), std::string::npos);
  build();
  const HttpResponse index = get("/?token=x");
  EXPECT_EQ(index.content(), "<html>");
  EXPECT_EQ(index.content_type, "text/html; charset=utf-8");
  EXPECT_EQ(header(index, "Cache-Control"), "no-cache");
  EXPECT_NE(header(index, "Content-Security-Policy").find("frame-ancestors 'none'"), std::string::npos);
  const HttpResponse script = get("/assets/main-EPFJUWFJ.js");
  EXPECT_EQ(script.content(), "script");
  EXPECT_EQ(script.content_type, "text/javascript; charset=utf-8");
  EXPECT_EQ(header(script, "Cache-Control"), "public, max-age=31536000, immutable");
  EXPECT_EQ(header(get("/assets/plain.css"), "Cache-Control"), "no-cache");
}

TEST_F(PageTest, GzipIsSentWhereAccepted) {
  build();
  page_ = PageFiles(folder_ / "dist");
  for (const char* accept : {"gzip", "deflate, gzip;q=1.0, br", "*"}) {
    const HttpResponse answer = get("/assets/main-EPFJUWFJ.js", accept);
    EXPECT_EQ(answer.content(), "packed") << accept;
    EXPECT_EQ(header(answer, "Content-Encoding"), "gzip");
    EXPECT_EQ(header(answer, "Vary"), "Accept-Encoding");
  }
  for (const char* accept : {"", "br", "gzip;q=0", "xgzip"}) {
    const HttpResponse answer = get("/assets/main-EPFJUWFJ.js", accept);
    EXPECT_EQ(answer.content(), "script") << accept;
    EXPECT_EQ(header(answer, "Content-Encoding"), "");
  }
  EXPECT_EQ(get("/assets/plain.css", "gzip").content(), "style")
      << "expected the plain file: there is no compressed one";
}

TEST_F(PageTest, MatchingEtagGivesNotModified) {
  build();
  page_ = PageFiles(folder_ / "dist");
  const std::string tag = header(get("/"), "ETag");
  const std::string packed = header(get("/assets/main-EPFJUWFJ.js", "gzip"), "ETag");
  EXPECT_NE(header(get("/assets/main-EPFJUWFJ.js"), "ETag"), packed)
      << "expected different tags for different bytes";
  for (const std::string& known : {tag, "\"x\", W/" + tag, std::string("*")}) {
    const HttpResponse answer = get("/", "", known);
    EXPECT_EQ(answer.status, 304u) << known;
    EXPECT_EQ(answer.content(), "");
  }
  EXPECT_EQ(get("/", "", "\"x\"").status, 200u);
  EXPECT_EQ(get("/assets/main-EPFJUWFJ.js", "gzip", packed).status, 304u);
}

TEST_F(PageTest, OtherPathsAreNotFound) {
  build();
  std::ofstream(folder_ / "outside.js") << "outside";
  fs::create_symlink(folder_ / "outside.js", folder_ / "dist/assets/link.js");
  page_ = PageFiles(folder_ / "dist");
  for (const char* target :
       {"/assets/secret.txt", "/secret.html", "/assets/link.js", "/../outside.js", "/assets/../index.html",
        "/assets/..%2findex.html", "/%61ssets/plain.css", "//assets/plain.css", "/assets//plain.css",
        "/assets/./plain.css", "/assets/plain.css/", "/assets", "/assets/", "/index.html.gz",
        "/assets/main-EPFJUWFJ.js.gz", "assets/plain.css", "http://localhost/", "*", ""}) {
    EXPECT_EQ(get(target).status, 404u) << target;
  }
  using std::string_literals::operator""s;
  EXPECT_EQ(get("/assets/plain.css\0.js"s).status, 404u);
}

}  // namespace
}  // namespace doppel
