// The attitude of a body that turns, and the same after a restart, behind a class of C++.
// g++ attitude.cpp -I../include -L../../../target/release -l:libzerorate.a -lm -o attitude
#include <array>
#include <cinttypes>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <stdexcept>
#include <vector>

#include "zerorate.h"

namespace {

using Vector = std::array<double, 3>;
using Quaternion = std::array<double, 4>;

void check(zr_code code)
{
    if (code != ZR_OK) throw std::runtime_error(zr_message(code));
}

// Copied as what it is: a value without pointers.
class Attitude {
public:
    explicit Attitude(const zr_attitude_params &params)
    {
        char why[200] = "";
        zr_attitude *self;
        if (zr_attitude_init(memory_, sizeof memory_, &params, &self) == ZR_PARAMETER) {
            zr_attitude_explain(&params, why, sizeof why);
            throw std::invalid_argument(why);
        }
    }

    explicit Attitude(const std::vector<std::uint8_t> &saved)
    {
        zr_attitude *self;
        check(zr_attitude_restore(memory_, sizeof memory_, saved.data(), saved.size(), &self));
    }

    Quaternion update(const Vector &gyro, const Vector &accel, const Vector *mag = nullptr)
    {
        Quaternion q;
        const double *field = mag ? mag->data() : nullptr;
        check(zr_attitude_update(self(), gyro.data(), accel.data(), field, NAN, q.data()));
        return q;
    }

    zr_attitude_state read() const
    {
        zr_attitude_state state;
        check(zr_attitude_read(reinterpret_cast<const zr_attitude *>(memory_), &state));
        return state;
    }

    std::vector<std::uint8_t> save() const
    {
        std::vector<std::uint8_t> bytes(ZR_ATTITUDE_CHECKPOINT);
        std::size_t used;
        const auto *self = reinterpret_cast<const zr_attitude *>(memory_);
        check(zr_attitude_save(self, bytes.data(), bytes.size(), &used));
        bytes.resize(used);
        return bytes;
    }

private:
    zr_attitude *self() { return reinterpret_cast<zr_attitude *>(memory_); }

    alignas(16) unsigned char memory_[ZR_ATTITUDE_MEMORY];
};

std::uint64_t sum_of(std::uint64_t sum, const Quaternion &q)
{
    for (double x : q) {
        std::uint64_t bits;
        std::memcpy(&bits, &x, sizeof bits);
        sum = (sum ^ bits) * UINT64_C(1099511628211);
    }
    return sum;
}

// Numbers from -0.5 to 0.5.
double noise(std::uint32_t &seed)
{
    seed = seed * UINT32_C(1664525) + UINT32_C(1013904223);
    return static_cast<double>(seed >> 8) / 16777216.0 - 0.5;
}

// Ten seconds of rest, then turns about all axes; nine axes, or six.
std::uint64_t run(bool mag)
{
    zr_attitude_params params{};
    params.rate = 100.0;
    params.mag = mag;
    Attitude attitude(params);
    std::uint32_t seed = 7;
    std::uint64_t sum = UINT64_C(14695981039346656037);
    for (int k = 0; k < 3000; k++) {
        const double turn = k < 1000 ? 0.0 : (k / 100 % 2 ? 0.5 : -0.5);
        const Vector gyro{0.01 + 0.01 * noise(seed) + turn, -0.02 + 0.01 * noise(seed),
                          0.005 + 0.01 * noise(seed) - 0.5 * turn};
        const Vector accel{0.1 * noise(seed), 0.1 * noise(seed), 9.81 + 0.1 * noise(seed)};
        const Vector field{0.1 * noise(seed), 20.0, -40.0};
        sum = sum_of(sum, attitude.update(gyro, accel, mag ? &field : nullptr));
        if (k == 1500) attitude = Attitude(attitude.save());
    }
    const zr_attitude_state known = attitude.read();
    std::printf("%d axes: bias %.3f %.3f %.3f rad/s, tilt +- %.4f rad, heading +- %.4f rad\n",
                mag ? 9 : 6, known.bias[0], known.bias[1], known.bias[2], known.tilt_sigma,
                known.heading_sigma);
    return sum;
}

} // namespace

int main()
{
    for (bool mag : {false, true}) {
        std::printf("sum %016" PRIx64 "\n", run(mag));
    }
    try {
        Attitude{zr_attitude_params{}};
    } catch (const std::invalid_argument &error) {
        std::printf("refused: %s\n", error.what());
    }
    return 0;
}
