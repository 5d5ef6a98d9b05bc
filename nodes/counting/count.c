/* Counts the reference's colours in boxes, straight from a BGR picture, and sums up the Bhattacharyya coefficient.
 *
 * A pixel has a joint index: from three tables, one a channel of the picture, or from its hue. Each joint index has
 * a row of marks: the codes that such a pixel counts for. Every pixel of a box is counted from an integral image
 * (Porikli 2005) whose entries hold all counters side by side, as narrow as the largest box allows: they wrap, the
 * differences do not. Where the boxes are so far apart that this is more work, their pixels are visited instead;
 * and a grid of samples always is.
 */
#include <math.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

enum { LANE_BYTES = 64 };

typedef struct {
    const uint8_t *pixels; /* blue, green, red */
    int64_t stride;        /* bytes from a row to the next */
    int32_t height, width;
    const uint16_t *index; /* three tables of 256: joint index = index[b] + index[256 + g] + index[512 + r], or */
    int32_t hue_bins;      /* if above 0, the bin of the hue, as nodes/filtering/color.py has it */
    int32_t grey_chroma, grey_saturation;
} picture;

typedef struct {
    int32_t parts, codes, joints;
    const int32_t *first; /* (parts + 1): part p has the codes from first[p] to first[p + 1] - 1 */
    const double *edges;  /* (parts + 1): where the parts begin and end, 0 to 1 */
    const uint8_t *marks; /* (joints, codes): 1 where a pixel of this joint index counts for this code */
    const double *scale;  /* (codes): what the root of a count is worth */
} reference;

typedef struct {
    int32_t columns, rows; /* of the grid; 0 counts every pixel */
    const double *x, *y;   /* (columns), (rows): where its samples lie, 0 to 1 */
    const int32_t *part;   /* (rows): the part of each row */
} sampling;

static int joint_index(const picture *p, const uint8_t *bgr) {
    int b = bgr[0], g = bgr[1], r = bgr[2];
    if (!p->hue_bins) return p->index[b] + p->index[256 + g] + p->index[512 + r];
    int largest = b > g ? b : g, least = b < g ? b : g;
    largest = largest > r ? largest : r;
    least = least < r ? least : r;
    int chroma = largest - least, n = p->hue_bins - 1;
    if (chroma < p->grey_chroma || p->grey_saturation * chroma < largest) return n;
    int hue = largest == r ? g - b : largest == g ? 2 * chroma + b - r : 4 * chroma + r - g;
    return n * (hue < 0 ? hue + 6 * chroma : hue) / (6 * chroma);
}

/* The pixel of a coordinate: within 0 and size; nowhere for NaN. */
static int cell(double coordinate, int size) {
    double c = floor(coordinate);
    return !(c > 0) ? 0 : c > size ? size : (int)c;
}

/* left, right and, for each part, where it begins and ends, in whole pixels whose centres lie inside. */
static void cells_of(const picture *p, const reference *r, const double *box, int *cells) {
    int nowhere = isnan(box[0]) || isnan(box[1]) || isnan(box[2]) || isnan(box[3]);
    cells[0] = nowhere ? 0 : cell(box[0] + 0.5, p->width);
    cells[1] = nowhere ? 0 : cell(box[2] + 0.5, p->width);
    for (int part = 0; part <= r->parts; part++)
        cells[2 + part] = nowhere ? 0 : cell(box[1] + r->edges[part] * (box[3] - box[1]) + 0.5, p->height);
}

/* One part by integral images of `lanes` counters an entry. `joint` is (h, w), from `top` and `left` on. */
#define INTEGRAL(name, number)                                                                                        \
    static int name(const uint16_t *joint, int h, int w, int top, int left, const reference *r, int part,             \
                    const int *cells, int n, int32_t *counts) {                                                       \
        enum { LANES = LANE_BYTES / sizeof(number) };                                                                 \
        const int step = 3 + r->parts, row = (w + 1) * LANES;                                                         \
        number *marks = calloc((size_t)r->joints * LANES, sizeof(number));                                            \
        number *sums = calloc((size_t)(h + 1) * row, sizeof(number));                                                 \
        for (int begin = r->first[part]; marks && sums && begin < r->first[part + 1]; begin += LANES) {               \
            int k = r->first[part + 1] - begin < LANES ? r->first[part + 1] - begin : LANES;                          \
            for (int j = 0; j < r->joints; j++)                                                                       \
                for (int c = 0; c < k; c++) marks[j * LANES + c] = r->marks[(size_t)j * r->codes + begin + c];        \
            /* I(y + 1, x + 1) = I(y, x + 1) + the marks of row y up to x */                                          \
            for (int y = 0; y < h; y++) {                                                                             \
                const number *above = sums + (size_t)y * row;                                                         \
                number *entry = sums + (size_t)(y + 1) * row;                                                         \
                number run[LANES] = {0};                                                                              \
                for (int x = 0; x < w; x++) {                                                                         \
                    const number *mark = marks + (size_t)joint[(size_t)y * w + x] * LANES;                            \
                    above += LANES, entry += LANES;                                                                   \
                    for (int c = 0; c < LANES; c++) run[c] += mark[c], entry[c] = above[c] + run[c];                  \
                }                                                                                                     \
            }                                                                                                         \
            for (int i = 0; i < n; i++) {                                                                             \
                const int *box = cells + i * step;                                                                    \
                int t = box[2 + part] - top, b = box[3 + part] - top, l = box[0] - left, m = box[1] - left;           \
                if (b <= t || m <= l) continue;                                                                       \
                const number *tl = sums + (size_t)t * row + l * LANES, *tr = sums + (size_t)t * row + m * LANES;      \
                const number *bl = sums + (size_t)b * row + l * LANES, *br = sums + (size_t)b * row + m * LANES;      \
                int32_t *count = counts + (size_t)i * r->codes + begin;                                               \
                for (int c = 0; c < k; c++) count[c] = (number)(br[c] - bl[c] - tr[c] + tl[c]);                       \
            }                                                                                                         \
        }                                                                                                             \
        int failed = !marks || !sums;                                                                                 \
        free(marks);                                                                                                  \
        free(sums);                                                                                                   \
        return failed;                                                                                                \
    }

INTEGRAL(integral8, uint8_t)
INTEGRAL(integral16, uint16_t)
INTEGRAL(integral32, uint32_t)

static void visit(const picture *p, const reference *r, int part, int x, int y, int32_t *count) {
    int joint = joint_index(p, p->pixels + y * p->stride + 3 * x);
    const uint8_t *marks = r->marks + (size_t)joint * r->codes;
    for (int c = r->first[part]; c < r->first[part + 1]; c++) count[c] += marks[c];
}

static void count_samples(const picture *p, const reference *r, const sampling *s, const double *boxes, int n,
                          int32_t *counts, int32_t *pixels) {
    for (int i = 0; i < n; i++) {
        const double *box = boxes + 4 * i;
        for (int row = 0; row < s->rows; row++) {
            double y = floor(s->y[row] * (box[3] - box[1]) + box[1]);
            if (!(y >= 0 && y < p->height)) continue;
            for (int column = 0; column < s->columns; column++) {
                double x = floor(s->x[column] * (box[2] - box[0]) + box[0]);
                if (!(x >= 0 && x < p->width)) continue;
                pixels[i * r->parts + s->part[row]]++;
                visit(p, r, s->part[row], (int)x, (int)y, counts + (size_t)i * r->codes);
            }
        }
    }
}

/* Every pixel of each part, from integral images or one box after the other. Returns 1 where memory lacks. */
static int count_pixels(const picture *p, const reference *r, const double *boxes, int n, int32_t *counts,
                        int32_t *pixels) {
    const int step = 3 + r->parts;
    int *cells = malloc(sizeof(int) * (size_t)n * step);
    if (!cells) return 1;
    int left = p->width, right = 0, top = p->height, bottom = 0, largest = 0;
    double touched = 0;
    for (int i = 0; i < n; i++) {
        int *box = cells + i * step;
        cells_of(p, r, boxes + 4 * i, box);
        int area = 0;
        for (int part = 0; part < r->parts; part++) {
            int of_part = (box[1] - box[0]) * (box[3 + part] - box[2 + part]);
            pixels[i * r->parts + part] = of_part;
            area += of_part;
            largest = of_part > largest ? of_part : largest;
        }
        if (!area) continue;
        touched += area;
        left = box[0] < left ? box[0] : left;
        right = box[1] > right ? box[1] : right;
        top = box[2] < top ? box[2] : top;
        bottom = box[2 + r->parts] > bottom ? box[2 + r->parts] : bottom;
    }
    int h = bottom - top, w = right - left, failed = 0;
    if (touched > 0 && touched * r->codes < 64.0 * h * w) {
        for (int i = 0; i < n; i++)
            for (int part = 0; part < r->parts; part++)
                for (int y = cells[i * step + 2 + part]; y < cells[i * step + 3 + part]; y++)
                    for (int x = cells[i * step]; x < cells[i * step + 1]; x++)
                        visit(p, r, part, x, y, counts + (size_t)i * r->codes);
    } else if (touched > 0) {
        uint16_t *joint = malloc(sizeof(uint16_t) * (size_t)h * w);
        failed = !joint;
        for (int y = 0; joint && y < h; y++)
            for (int x = 0; x < w; x++)
                joint[(size_t)y * w + x] = joint_index(p, p->pixels + (y + top) * p->stride + 3 * (x + left));
        for (int part = 0; joint && part < r->parts; part++) {
            int first = p->height, last = 0;
            for (int i = 0; i < n; i++) {
                if (!pixels[i * r->parts + part]) continue;
                first = cells[i * step + 2 + part] < first ? cells[i * step + 2 + part] : first;
                last = cells[i * step + 3 + part] > last ? cells[i * step + 3 + part] : last;
            }
            if (last <= first) continue;
            const uint16_t *rows = joint + (size_t)(first - top) * w;
            failed |= (largest < 256     ? integral8
                       : largest < 65536 ? integral16
                                         : integral32)(rows, last - first, w, first, left, r, part, cells, n, counts);
        }
        free(joint);
    }
    free(cells);
    return failed;
}

/* Counts (n, codes), pixels (n, parts), both zero before, and coefficients (n): the sum over the parts of
 * (sum over the codes of scale * root of the count) / root of the part's pixels. Returns 1 where memory lacks. */
int dcpf_count(const picture *p, const reference *r, const sampling *s, const double *boxes, int32_t n,
               int32_t *counts, int32_t *pixels, double *coefficients) {
    if (s->rows)
        count_samples(p, r, s, boxes, n, counts, pixels);
    else if (count_pixels(p, r, boxes, n, counts, pixels))
        return 1;
    for (int i = 0; i < n; i++) {
        coefficients[i] = 0;
        for (int part = 0; part < r->parts; part++) {
            double sum = 0;
            for (int c = r->first[part]; c < r->first[part + 1]; c++)
                sum += r->scale[c] * sqrt((double)counts[(size_t)i * r->codes + c]);
            int in_part = pixels[i * r->parts + part];
            coefficients[i] += sum / sqrt(in_part > 0 ? (double)in_part : 1.0);
        }
    }
    return 0;
}
