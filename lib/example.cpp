/* Makes a data set of a volume in memory and draws it, in C++. Build it with
 * c++ example.cpp $(pkg-config --cflags --libs triptych)
 *
 *     example_cpp DATA.trip PICTURE.png
 *
 * The volume is a red body, 16 voxels thick. Prints red, green, blue and opacity of the middle of
 * the picture, and of its upper left corner. */
#include <cstdint>
#include <cstdio>
#include <memory>
#include <stdexcept>
#include <triptych.h>
#include <triptych_brick.h>
#include <vector>

namespace
{

const int SIZE = 32, WIDTH = 160, HEIGHT = 120;

class Volume
{
  public:
    Volume() : context(nullptr, triptych_destroy)
    {
        triptych *created = nullptr;
        if (triptych_create(&created) != TRIPTYCH_OK)
            throw std::runtime_error("triptych_create() failed");
        context.reset(created);
    }

    void brick(const char *data_set, const std::vector<std::uint8_t> &values)
    {
        triptych_volume volume = triptych_volume();
        volume.type = "uint8";
        for (std::int64_t &dim : volume.dims)
            dim = SIZE;
        volume.data = values.data();
        triptych_brick_options options = triptych_brick_options();
        options.in_memory = &volume;
        options.keep_all = 1;
        check(triptych_brick(context.get(), "body", data_set, &options, nullptr));
    }

    /* Looks along an axis, in parallel. The body covers half of the height. */
    void look(const char *data_set)
    {
        check(triptych_open(context.get(), data_set, nullptr));
        triptych_transfer_function function = triptych_transfer_function();
        function.text = "0 1 0 0 0\n100 1 0 0 0\n100 1 0 0 0.1\n";
        check(triptych_set_transfer_function(context.get(), &function));
        triptych_light light = triptych_light();
        light.no_shading = 1;
        triptych_settings settings = triptych_settings();
        settings.light = &light;
        const double nothing[4] = { 0, 0, 0, 0 };
        settings.background = nothing;
        check(triptych_set_settings(context.get(), &settings));
        triptych_view view = triptych_view();
        view.width = WIDTH;
        view.height = HEIGHT;
        view.side = TRIPTYCH_SIDE_FRONT;
        view.ortho_height = SIZE;
        check(triptych_set_view(context.get(), &view));
    }

    std::vector<float> draw()
    {
        std::vector<float> rgba(4u * WIDTH * HEIGHT);
        check(triptych_draw(context.get(), rgba.data()));
        return rgba;
    }

    void write(const char *picture, const std::vector<float> &rgba)
    {
        check(triptych_write(context.get(), picture, WIDTH, HEIGHT, rgba.data()));
    }

  private:
    void check(int status)
    {
        if (status != TRIPTYCH_OK)
            throw std::runtime_error(triptych_error(context.get()));
    }

    std::unique_ptr<triptych, void (*)(triptych *)> context;
};

/* Values are 200 in the body and 0 around it. */
std::vector<std::uint8_t> body()
{
    std::vector<std::uint8_t> values;
    auto inside = [](int i) { return i >= SIZE / 4 && i < SIZE - SIZE / 4; };
    for (int z = 0; z < SIZE; z++)
        for (int y = 0; y < SIZE; y++)
            for (int x = 0; x < SIZE; x++)
                values.push_back(inside(x) && inside(y) && inside(z) ? 200 : 0);
    return values;
}

void print(const float *pixel)
{
    std::printf("%.4f %.4f %.4f %.4f\n", pixel[0], pixel[1], pixel[2], pixel[3]);
}

} /* namespace */

int main(int argc, char **argv)
{
    if (argc != 3)
        return 2;
    try {
        Volume volume;
        volume.brick(argv[1], body());
        volume.look(argv[1]);
        std::vector<float> rgba = volume.draw();
        volume.write(argv[2], rgba);
        print(&rgba[4 * (HEIGHT / 2 * WIDTH + WIDTH / 2)]);
        print(&rgba[0]);
    } catch (const std::exception &e) {
        std::fprintf(stderr, "%s\n", e.what());
        return 1;
    }
    return 0;
}
