/* test_ogre.cc - the library inside OGRE: a flow on OGRE's memory, threads and clock leaves the bits that it leaves without OGRE,
   and the picture shows the surface. Skipped where OGRE is not installed, or Xvfb. */
#include "greatest.h"

GREATEST_MAIN_DEFS();

#if !__has_include(<OGRE/Ogre.h>) || !__has_include(<stb/stb_image.h>)

TEST ogre_is_not_installed(void) { SKIPm("there is no OGRE, or no stb_image"); }

int main(int argc, char **argv)
{
    GREATEST_MAIN_BEGIN();
    RUN_TEST(ogre_is_not_installed);
    GREATEST_MAIN_END();
}

#else

#define main ogre_main
#include "../../examples/engines/ogre.cpp"
#undef main
#define STB_IMAGE_IMPLEMENTATION
#define STB_IMAGE_STATIC
#include <stb/stb_image.h>

#include <csignal>
#include <sys/wait.h>
#include <unistd.h>

/* Starts a virtual display, which prints its number when it is ready. Returns its process, or 0 where there is none. */
static pid_t start_display()
{
    char number[16] = ":", end[16];
    int ends[2];
    if (pipe(ends) != 0) return 0;
    std::snprintf(end, sizeof end, "%d", ends[1]);
    const pid_t display = fork();
    if (display == 0) {
        if (!std::freopen("/dev/null", "w", stderr)) _exit(127);
        execlp("Xvfb", "Xvfb", "-displayfd", end, "-screen", "0", "800x600x24", "-nolisten", "tcp", static_cast<char *>(nullptr));
        _exit(127);
    }
    close(ends[1]);
    const ssize_t length = read(ends[0], number + 1, sizeof number - 2);
    close(ends[0]);
    if (length <= 0) {
        waitpid(display, nullptr, 0);
        return 0;
    }
    number[1 + std::strcspn(number + 1, "\n")] = '\0';
    setenv("DISPLAY", number, 1);
    return display;
}

/* Counts the pixels of the checks: more blue than red, and less. The background is grey. */
static bool count_colours(const std::string &file, int &blue, int &orange)
{
    int width, height, channels;
    unsigned char *const pixels = stbi_load(file.c_str(), &width, &height, &channels, 3);
    if (!pixels) return false;
    blue = orange = 0;
    for (const unsigned char *p = pixels; p < pixels + 3 * width * height; p += 3) {
        blue += p[2] > p[0] + 40;
        orange += p[0] > p[2] + 40;
    }
    stbi_image_free(pixels);
    return true;
}

TEST the_engine_leaves_the_same_bits_and_a_picture()
{
    char file[] = "/tmp/springls_ogre_XXXXXX.png";
    const int made = mkstemps(file, 4);
    const pid_t display = start_display();
    Options options;
    int blue = 0, orange = 0;
    if (made >= 0) close(made);
    if (!display) SKIPm("there is no Xvfb");
    options.grid = 32;
    options.steps = 5;
    options.threads = 3;
    options.picture = file;
    uint64_t with_engine = 0;
    std::string failure;
    try {
        with_engine = run(options);
    } catch (const std::exception &why) {
        failure = why.what();
    } catch (const std::string &why) {
        failure = why;
    }
    kill(display, SIGTERM);
    waitpid(display, nullptr, 0);
    const bool read = count_colours(file, blue, orange);
    unlink(file);
    ASSERT_STR_EQ("", failure.c_str());
    ASSERT(with_engine == run_alone(options));
    ASSERT(read);
    ASSERT(blue > 1500 && orange > 1500);
    PASS();
}

TEST wrong_arguments_are_refused()
{
    Options options;
    const char *wrong[][3] = {
        {"ogre", "--grid", "8"}, {"ogre", "--grid", "64x"}, {"ogre", "--steps", "0"}, {"ogre", "--alone", "--speed"}};
    for (auto &arguments : wrong) ASSERT(!parse(3, const_cast<char **>(arguments), options));
    PASS();
}

int main(int argc, char **argv)
{
    GREATEST_MAIN_BEGIN();
    RUN_TEST(the_engine_leaves_the_same_bits_and_a_picture);
    RUN_TEST(wrong_arguments_are_refused);
    GREATEST_MAIN_END();
}

#endif
