/* MUMPS's factors in single precision, of a matrix whose entries are spread over ranks. What
 * returns an int returns MUMPS's INFOG(1), the same on all ranks: 0, or a negative error.
 */

/* Factors to be, on the ranks of a communicator (Fortran's number); 0 where there is no room. */
void *begin(int communicator);

/* Of unknowns and this rank's entries: row and column, from 1. Both are kept by the caller. */
int analyse(void *factors, int unknowns, long long entries, int *rows, int *columns);

/* Analyse on one rank if some unknowns (from 1) are to be left: the factors are of the others, in
 * the given order, and what these add to the equations of those left is a dense matrix (left, left),
 * by rows. MUMPS has no good order of its own for that. */
int analyse_inner(void *factors, int unknowns, long long entries, int *rows, int *columns,
                  int *order, int left, int *unknowns_left, float *added);

/* With the entries' values, and room beyond the estimate, %. Values are the caller's, too. */
int factorise(void *factors, float *values, int room);

/* How many pivots it had to make up, which is where unknowns are left and its own are too small. */
int replaced(void *factors);

/* The solution replaces the load, both of all unknowns, on the first rank. */
int solve(void *factors, float *load);

/* The same for loads by their entries: those of load k are first[k] to first[k + 1], from 1, of
 * rows, from 1, and values. The solutions are (count, unknowns). */
int solve_many(void *factors, int count, int *first, int *rows, float *values, float *solutions);

/* Of a load of all unknowns what comes to those left: the first pass through the factors. The
 * second, `expand`, needs what the first one leaves in them. */
int condense(void *factors, float *load, float *condensed);

/* The same for loads by their entries (`solve_many`), of which there are some: (count, left). */
int condense_many(void *factors, int count, int *first, int *rows, float *values,
                  float *condensed);

/* The solutions (count, unknowns) from those of the unknowns left (count, left). */
int expand(void *factors, int count, float *found, float *solutions);

void end(void *factors);
