"""Maps: shapes, folds and growth rates of very many cables, computed on many processes, stored, looked up."""
