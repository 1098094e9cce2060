// The part of OpenCL C that the kernels use, in C++ for the processor; put before them. The items of a work-group take turns from barrier
// to barrier. There is no binary16.

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstring>
#include <functional>
#include <type_traits>
#include <ucontext.h>
#include <utility>
#include <vector>

#define __kernel static
#define __global
#define __local
#define __constant static const
#define SHARED static thread_local
#define WORK_GROUP(items)
#define CLK_LOCAL_MEM_FENCE 0

typedef unsigned char uchar;
typedef unsigned int uint;
typedef unsigned long ulong;
struct int4 {
    int x, y, z, w;
};

using std::fabs;
using std::fma;
using std::max;
using std::min;
using std::sqrt;

static long as_long(double x) {
    long bits;
    std::memcpy(&bits, &x, 8);
    return bits;
}

static double as_double(long bits) {
    double x;
    std::memcpy(&x, &bits, 8);
    return x;
}

namespace items {
thread_local size_t local, of_group, group;
thread_local ucontext_t all, *own;
thread_local bool is_done;
thread_local std::function<void()> work;

void enter() {
    work();
    is_done = true;
}

// A work-group whose items run one after the other, each up to its next barrier.
void take_turns(std::vector<ucontext_t>& items, std::vector<char>& stacks) {
    std::vector<bool> done(items.size(), false);
    size_t stack = stacks.size() / items.size();
    for (size_t k = 0; k < items.size(); k++) {
        getcontext(&items[k]);
        items[k].uc_stack.ss_sp = stacks.data() + k * stack;
        items[k].uc_stack.ss_size = stack;
        items[k].uc_link = &all;
        makecontext(&items[k], enter, 0);
    }
    for (size_t left = items.size(); left > 0;) {
        for (local = 0; local < items.size(); local++) {
            if (done[local]) continue;
            own = &items[local];
            is_done = false;
            swapcontext(&all, own);
            if (is_done) {
                done[local] = true;
                left--;
            }
        }
    }
}

template <typename... A, size_t... I>
void run(void (*kernel)(A...), void** arguments, size_t groups, size_t count, bool has_barriers, std::index_sequence<I...>) {
    work = [=] { kernel(*static_cast<A*>(arguments[I])...); };
    of_group = count;
    std::vector<ucontext_t> items(has_barriers ? count : 0);
    std::vector<char> stacks(items.size() << 16);
    for (group = 0; group < groups; group++) {
        if (has_barriers) {
            take_turns(items, stacks);
        } else {
            for (local = 0; local < count; local++) work();
        }
    }
}

template <typename... A>
void launch(void (*kernel)(A...), void** arguments, size_t groups, size_t count, bool has_barriers) {
    run(kernel, arguments, groups, count, has_barriers, std::index_sequence_for<A...>());
}
}  // namespace items

static void barrier(int) { swapcontext(items::own, &items::all); }
static size_t get_local_id(int) { return items::local; }
static size_t get_group_id(int) { return items::group; }
static size_t get_global_id(int) { return items::group * items::of_group + items::local; }

// Each rank has arrays of its own.
static long atom_add(long* sum, long x) {
    long before = *sum;
    *sum += x;
    return before;
}
