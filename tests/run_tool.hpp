/// \file
/// Running a program as its users do, and what it leaves behind.
#pragma once

#include <algorithm>
#include <cstdlib>
#include <fcntl.h>
#include <filesystem>
#include <fmt/format.h>
#include <fmt/ranges.h>
#include <fstream>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>
#include <spawn.h>
#include <sstream>
#include <stdexcept>
#include <string>
#include <sys/wait.h>
#include <unistd.h>
#include <vector>

namespace costate::tools {

namespace fs = std::filesystem;
using nlohmann::json;
using Arguments = std::vector<std::string>;

inline bool contains(const std::string& text, const std::string& part) { return text.find(part) != std::string::npos; }

inline std::string contents(const fs::path& file) {
  std::ifstream in(file, std::ios::binary);
  std::ostringstream text;
  text << in.rdbuf();
  return text.str();
}

/// What a program left behind.
struct Ended {
  int status = -1;  ///< exit status; −signal if a signal ended it
  std::string out, err;
};

/// A command line that is not admissible, and what the message must say: flag, value, range.
struct BadInput {
  Arguments arguments;
  Arguments named;
};

/// Tests of a program. Each has a folder of its own, removed with it.
class ToolTest : public testing::Test {
 protected:
  explicit ToolTest(std::string program) : program_(std::move(program)) {
    std::string pattern = (fs::temp_directory_path() / "costate-tool-XXXXXX").string();
    if (mkdtemp(pattern.data()) == nullptr) throw std::runtime_error("no temporary folder");
    folder_ = pattern;
  }
  ~ToolTest() override { fs::remove_all(folder_); }
  ToolTest(const ToolTest&) = delete;
  ToolTest& operator=(const ToolTest&) = delete;

  [[nodiscard]] const fs::path& folder() const { return folder_; }

  /// Runs the program with the given arguments. Standard output goes to `out_file` if one is named.
  Ended run(const Arguments& arguments, const std::string& out_file = "") {
    const std::string out = out_file.empty() ? (folder_ / ".out").string() : out_file;
    const std::string err = (folder_ / ".err").string();
    std::vector<char*> argv;
    Arguments words{program_};
    words.insert(words.end(), arguments.begin(), arguments.end());
    for (std::string& word : words) argv.push_back(word.data());
    argv.push_back(nullptr);

    posix_spawn_file_actions_t streams;
    posix_spawn_file_actions_init(&streams);
    posix_spawn_file_actions_addopen(&streams, STDIN_FILENO, "/dev/null", O_RDONLY, 0);
    posix_spawn_file_actions_addopen(&streams, STDOUT_FILENO, out.c_str(), O_WRONLY | O_CREAT | O_TRUNC, 0600);
    posix_spawn_file_actions_addopen(&streams, STDERR_FILENO, err.c_str(), O_WRONLY | O_CREAT | O_TRUNC, 0600);
    pid_t child = 0;
    const int failed = posix_spawn(&child, program_.c_str(), &streams, nullptr, argv.data(), environ);
    posix_spawn_file_actions_destroy(&streams);
    if (failed != 0) throw std::runtime_error(program_ + " cannot be run");
    int state = 0;
    waitpid(child, &state, 0);
    Ended result;
    result.status = WIFEXITED(state) ? WEXITSTATUS(state) : -WTERMSIG(state);
    if (out_file.empty()) result.out = contents(out);
    result.err = contents(err);
    fs::remove(folder_ / ".out");
    fs::remove(folder_ / ".err");
    return result;
  }

  /// The one JSON object that the program prints of a scene that it solves.
  json solved_json(Arguments arguments) {
    arguments.emplace_back("--json");
    const Ended got = run(arguments);
    EXPECT_EQ(got.status, 0) << got.err;
    EXPECT_EQ(got.err, "");
    return json::parse(got.out);  // throws unless there is exactly one value
  }

  /// Bad input is answered by status 2 and one line that says what is admissible, before anything is printed.
  void expect_refusals(const std::vector<BadInput>& cases) {
    for (const BadInput& bad : cases) {
      const Ended got = run(bad.arguments);
      const std::string line = fmt::format("{}\n{}", fmt::join(bad.arguments, " "), got.err);
      EXPECT_EQ(got.status, 2) << line;
      EXPECT_EQ(got.out, "") << line;
      for (const std::string& part : bad.named) {
        EXPECT_TRUE(contains(got.err, part)) << part << " is not in the message of " << line;
      }
      EXPECT_EQ(std::count(got.err.begin(), got.err.end(), '\n'), 1) << "one line: " << line;
    }
  }

 private:
  std::string program_;
  fs::path folder_;
};

}  // namespace costate::tools
