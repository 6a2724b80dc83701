/* MUMPS's factors in single precision, of a matrix whose entries are spread over ranks. What
 * returns an int returns MUMPS's INFOG(1), the same on all ranks: 0, or a negative error.
 */

/* Factors to be, on the ranks of a communicator (Fortran's number); 0 where there is no room. */
void *begin(int communicator);

/* Of unknowns and this rank's entries: row and column, from 1. Both are kept by the caller. */
int analyse(void *factors, int unknowns, long long entries, int *rows, int *columns);

/* With the entries' values, and room beyond the estimate, %. Values are the caller's, too. */
int factorise(void *factors, float *values, int room);

/* The solution replaces the load, both of all unknowns, on the first rank. */
int solve(void *factors, float *load);

/* The same for loads by their entries: those of load k are first[k] to first[k + 1], from 1, of
 * rows, from 1, and values. The solutions are (count, unknowns). */
int solve_many(void *factors, int count, int *first, int *rows, float *values, float *solutions);

void end(void *factors);
