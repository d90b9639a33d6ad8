mod capstone;
mod normal;
mod samples;
