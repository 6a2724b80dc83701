/* Points of all ranks on the grid: nodes around each and their weights, (n, corners). */
typedef struct {
    int n, corners;
    const int *node;
    const double *share;
} Points;

/* The surface in a stage: nx * ny = n nodes and as many lateral modes, of a matrix (nodes, modes)
 * for each line and its inverse, none along y in a slice; without any, heat stays in the columns.
 * cell_area: of the nodes, m2; offset: their temperature without heat, K; resistance: of the modes,
 * or of the columns, K m2/W; scratch: room for (2, n). */
typedef struct {
    int nx, ny, n;
    const double *x_vectors, *x_inverse, *y_vectors, *y_inverse;
    const double *cell_area, *offset, *resistance;
    const Points *points;
    double *scratch;
} Surface;

/* What a point gives (W) near the temperature at which it was asked: the smaller of two lines, a
 * heat there and its fall (W/K). */
typedef struct {
    double heat, fall, other_heat, other_fall;
} Fluxes;

/* Of `balance`: it is found, and no heat depends on the temperature; some does; it is not found in
 * so many iterations; a system has no solution, or there is no memory. */
enum { FOUND, DEPENDS, UNSETTLED, FAILED };

void lapack(void *product, void *factorise, void *solve);
int melting_guess(Surface *surface, const double *powers, const double *areas, double link,
                  double melting_temperature, double *temperature);
int balance(Surface *surface, const Fluxes *fluxes, double agreement, double within,
            int iterations, double *temperature, double *given, int *changes);
