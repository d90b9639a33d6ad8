// C++ as embedded projects use it: virtual calls, pointers to members, templates, static constructors, lambdas.
#include "foreign.h"

namespace {

struct Shape {
    virtual uint32_t area() const = 0;
    virtual void grow(uint32_t by) = 0;

protected:
    ~Shape() = default;
};

struct Square final : Shape {
    explicit Square(uint32_t side) : side(side) {}
    uint32_t area() const override { return side * side; }
    void grow(uint32_t by) override { side += by; }
    uint32_t side;
};

struct Rectangle : Shape {
    Rectangle(uint32_t width, uint32_t height) : width(width), height(height) {}
    uint32_t area() const override { return width * height; }
    void grow(uint32_t by) override { width += by, height += 2 * by; }
    uint32_t width, height;
};

struct Frame final : Rectangle {
    using Rectangle::Rectangle;
    uint32_t area() const override { return Rectangle::area() - (width - 2) * (height - 2); }
};

struct Named {
    virtual const char *name() const { return "named"; }
};

struct Both final : Rectangle, Named {
    Both() : Rectangle(3, 5) {}
    const char *name() const override { return "both"; }
    void grow(uint32_t by) override { Rectangle::grow(by * 3); }
};

template <typename T, int N> class Ring {
public:
    void push(T value) { values[at++ % N] = value; }
    template <typename F> T fold(T first, F f) const
    {
        for (T value : values)
            first = f(first, value);
        return first;
    }

private:
    T values[N] = {};
    uint32_t at = 0;
};

// Constructed before main, in the order of the text.
struct Counter {
    explicit Counter(uint32_t start) : value(start * 7 + previous) { previous = value; }
    static uint32_t previous;
    uint32_t value;
};
uint32_t Counter::previous = 1;
Counter first(3), second(first.value), third(second.value ^ 0x55);

Square square(4);
Rectangle rectangle(6, 7);
Frame frame(9, 10);
Both both;

} // namespace

int main(void)
{
    Shape *const shapes[] = {&square, &rectangle, &frame, &both};
    Ring<uint32_t, 9> areas;
    for (uint32_t i = 0; i < 40; i++) {
        Shape *shape = shapes[random_word() & 3];
        shape->grow(i & 3);
        areas.push(shape->area());
    }
    uint32_t (Shape::*const measure)() const = &Shape::area;
    for (Shape *shape : shapes)
        say("area", (shape->*measure)());
    const uint32_t factor = random_word() | 1;
    say("fold", areas.fold(0, [factor](uint32_t a, uint32_t b) { return a * factor + b; }));
    Named &named = both;
    put(named.name());
    put("\n");
    say("constructed", third.value);
    return 0;
}

// A pure virtual function cannot be called here; the library's own message would bring in half of the library.
extern "C" void __cxa_pure_virtual() { leave(2); }
