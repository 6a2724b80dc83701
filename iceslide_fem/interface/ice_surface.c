/* The surface of ice within an implicit stage, and the points of all ranks on it: what
 * `melting_guess` and `ice_balance` have in common. They are compiled as one.
 *
 * Arrays have a few hundred nodes and a few thousand points, and are gone through too often for
 * calls of NumPy. Values of nodes are (nx, ny), y innermost and 1 in a slice; matrices are as C has
 * them.
 */
#include <math.h>
#include <stdlib.h>
#include <string.h>

/* BLAS and LAPACK, as SciPy has them (see `lapack`). */
typedef void Product(const char *, const char *, const int *, const int *, const int *,
                     const double *, const double *, const int *, const double *, const int *,
                     const double *, double *, const int *);
typedef void Factorise(const char *, const int *, const int *, double *, const int *, int *);
typedef void SolveFactored(const char *, const int *, const int *, const int *, const double *,
                           const int *, double *, const int *, int *);
static Product *dgemm;
static Factorise *dpbtrf;
static SolveFactored *dpbtrs;

void lapack(void *product, void *factorise, void *solve)
{
    dgemm = (Product *)product;
    dpbtrf = (Factorise *)factorise;
    dpbtrs = (SolveFactored *)solve;
}

/* fmin and fmax, but for NaN, are calls: no loop with one is made of vectors. */
static double smaller(double a, double b)
{
    return a < b ? a : b;
}

static double larger(double a, double b)
{
    return a > b ? a : b;
}

static double largest(int n, const double *x)
{
    double most = 0.0;
    for (int i = 0; i < n; i++) {
        if (!isfinite(x[i]))
            return x[i];
        most = larger(most, fabs(x[i]));
    }
    return most;
}

static double dot(int n, const double *x, const double *y)
{
    double sum = 0.0;
    for (int i = 0; i < n; i++)
        sum += x[i] * y[i];
    return sum;
}

static void add(int n, double share, const double *x, double *y)
{
    for (int i = 0; i < n; i++)
        y[i] += share * x[i];
}

/* ---- Points on the grid: bilinear, and with the same weights back. ---- */

static void interpolate(const Points *points, const double *nodes, double *values)
{
    for (int p = 0, i = 0; p < points->n; p++) {
        double sum = 0.0;
        for (int corner = 0; corner < points->corners; corner++, i++)
            sum += points->share[i] * nodes[points->node[i]];
        values[p] = sum;
    }
}

static void scatter(const Surface *surface, const double *amounts, double *nodes)
{
    const Points *points = surface->points;
    memset(nodes, 0, (size_t)surface->n * sizeof *nodes);
    for (int p = 0, i = 0; p < points->n; p++)
        for (int corner = 0; corner < points->corners; corner++, i++)
            nodes[points->node[i]] += points->share[i] * amounts[p];
}

/* ---- The ice below: diagonal in the lateral modes, or column by column. ---- */

/* out (rows, columns) = a b, each as it is ('N') or transposed ('T'), of `inner` terms. */
static void product(char a_as, char b_as, int rows, int columns, int inner, const double *a,
                    const double *b, double *out)
{
    const double one = 1.0, zero = 0.0;
    const int a_width = a_as == 'N' ? inner : rows, b_width = b_as == 'N' ? columns : inner;
    dgemm(&b_as, &a_as, &columns, &rows, &inner, &one, b, &b_width, a, &a_width, &zero, out,
          &columns); /* BLAS counts columns first: it finds the transposed product */
}

/* X a Y^T, or X^T a Y if `transposed`, with a matrix for each line. */
static void along_lines(const Surface *surface, const double *x, const double *y, int transposed,
                        const double *a, double *out)
{
    const int nx = surface->nx, ny = surface->ny;
    const double *rows = a;
    if (ny > 1) {
        product('N', transposed ? 'N' : 'T', nx, ny, ny, a, y, surface->scratch);
        rows = surface->scratch;
    }
    product(transposed ? 'T' : 'N', 'N', nx, ny, nx, x, rows, out);
}

/* What the ice takes (W) where its surface is by `rise` (K) above the offset. */
static void taken(const Surface *surface, const double *rise, double *out)
{
    if (!surface->x_inverse) {
        for (int i = 0; i < surface->n; i++)
            out[i] = surface->cell_area[i] / surface->resistance[i] * rise[i];
        return;
    }
    double *amplitudes = surface->scratch + surface->n;
    along_lines(surface, surface->x_inverse, surface->y_inverse, 0, rise, amplitudes);
    for (int i = 0; i < surface->n; i++)
        amplitudes[i] /= surface->resistance[i];
    along_lines(surface, surface->x_inverse, surface->y_inverse, 1, amplitudes, out);
}

/* How far (K) the surface is above the offset where the ice takes the `heat` (W). */
static void warmed(const Surface *surface, const double *heat, double *out)
{
    if (!surface->x_vectors) {
        for (int i = 0; i < surface->n; i++)
            out[i] = surface->resistance[i] / surface->cell_area[i] * heat[i];
        return;
    }
    double *amplitudes = surface->scratch + surface->n;
    along_lines(surface, surface->x_vectors, surface->y_vectors, 1, heat, amplitudes);
    for (int i = 0; i < surface->n; i++)
        amplitudes[i] *= surface->resistance[i];
    along_lines(surface, surface->x_vectors, surface->y_vectors, 0, amplitudes, out);
}

static double most_resistance(const Surface *surface, double *least)
{
    double most = *least = surface->resistance[0];
    for (int i = 1; i < surface->n; i++) {
        most = larger(most, surface->resistance[i]);
        *least = smaller(*least, surface->resistance[i]);
    }
    return most;
}

/* ---- Conjugate gradients, preconditioned. ---- */

/* A symmetric system: what x loads (out), what answers a load (out), whether that is close. */
typedef struct Linear {
    const Surface *surface;
    void (*load)(const struct Linear *, const double *x, double *out);
    int (*answered)(const struct Linear *, const double *load, double *out);
    int (*close)(const struct Linear *, const double *answer, double share);
    const double *bands, *factor, *per_heat; /* what these need */
    double small;
    const int *apart; /* numbers of the nodes that a band joins, `band_count` of them */
    int iterations, width, band_count;
} Linear;

/* x with load(x) = left, and what is left of it; whether that is close. work: (3, n).
 * `answered` may be blind to some of it: there x stays zero, and something is left. */
static int conjugate_gradients(const Linear *linear, double *x, double *left, double *work)
{
    const int n = linear->surface->n;
    double *direction = work, *answer = work + n, *against = work + 2 * n;
    memset(x, 0, (size_t)n * sizeof *x);
    if (!linear->answered(linear, left, answer))
        return 0;
    memcpy(direction, answer, (size_t)n * sizeof *answer);
    double size = dot(n, left, answer);
    const double first = size;
    for (int iteration = 0; iteration < linear->iterations; iteration++) {
        if (linear->close(linear, answer, first != 0.0 ? size / first : 0.0))
            return 1;
        linear->load(linear, direction, against);
        const double length = size / dot(n, direction, against);
        add(n, length, direction, x);
        add(n, -length, against, left);
        if (!linear->answered(linear, left, answer))
            return 0;
        const double before = size;
        size = dot(n, left, answer);
        for (int i = 0; i < n; i++)
            direction[i] = answer[i] + size / before * direction[i];
    }
    return 0;
}
